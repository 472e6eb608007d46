"""The 4-RPRP translational robot of [GarciaMurillo2016]."""

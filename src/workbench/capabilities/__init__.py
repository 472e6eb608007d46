"""What any robot can do, each a function of the robot and its reference, by closed form where one is registered."""

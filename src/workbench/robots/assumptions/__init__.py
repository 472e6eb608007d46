"""What a closed form takes for granted about a model, checked on the compiled numbers."""

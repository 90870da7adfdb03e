"""What is unknown of any robot, from recordings of its motion."""

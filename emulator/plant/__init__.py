"""The plant: motor, friction, gears with backlash, and the encoder on the motor's shaft."""

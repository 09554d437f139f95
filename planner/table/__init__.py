"""The seventh axis: the equations of its motion (Eq. 3 to 7), its speed profile, and their encoding in the protocol."""

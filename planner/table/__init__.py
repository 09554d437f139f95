"""The seventh axis: the equations of its motion (Eq. 3 to 7), its speed profile, and how both are said on the wire."""

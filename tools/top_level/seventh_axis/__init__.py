"""What is installed under a name of its own, so that it clashes with nobody's package: the command and the plug-in.

It imports none of the other packages until they are needed.
"""

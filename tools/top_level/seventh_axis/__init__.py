"""The part that is installed under a unique name, so that it conflicts with no other package: command and plug-in.

It imports none of the other packages until they are needed.
"""

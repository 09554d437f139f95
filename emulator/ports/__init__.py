"""Where clients come in: pseudo-terminal, TCP, RFC 2217."""

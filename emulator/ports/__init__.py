"""The ports for clients: pseudo-terminal, TCP, RFC 2217."""

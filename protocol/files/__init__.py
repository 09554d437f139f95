"""Files of JSON and TOML: read with one reader, written whole or not at all."""

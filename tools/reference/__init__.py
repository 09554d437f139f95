"""Reference pages of the docs, generated from the code: command lines and the keys of every TOML file."""

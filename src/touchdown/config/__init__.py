"""Settings of a run: sections, rules across them, TOML, presets."""

"""Settings of a run: sections, rules between them, TOML, presets."""

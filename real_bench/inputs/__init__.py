"""What users give, checked: numbers, names, fields and YAML files."""

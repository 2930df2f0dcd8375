"""What users give, checked: numbers, text of a certain form, and YAML files."""

"""Checks case files against the JSON Schema: validate.py SCHEMA CASE..."""

import json
import sys
import tomllib

import jsonschema

with open(sys.argv[1]) as file:
    schema = json.load(file)
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
for path in sys.argv[2:]:
    with open(path, "rb") as file:
        validator.validate(tomllib.load(file))
    print(path, "is valid")

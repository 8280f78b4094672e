"""Show the fields of a class as one table of the reference: an extension of griffe, which mkdocs.yml names."""

from __future__ import annotations

from typing import Any

import griffe


class Fields(griffe.Extension):
    """Move the docstrings of fields into the class, with the range of a type instead of its private name."""

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Change one class."""
        fields = [member for member in cls.members.values() if isinstance(member, griffe.Attribute)]
        for field in fields:
            alias = cls.module.members.get(str(field.annotation)) if str(field.annotation).startswith("_") else None
            if isinstance(alias, griffe.Attribute):
                field.annotation = alias.value
        described = [field for field in fields if field.docstring is not None and "property" not in field.labels]
        if described and cls.docstring is not None and "Attributes:" not in cls.docstring.value:
            rows = "".join(f"\n    {field.name}: {' '.join(_text(field).split())}" for field in described)
            cls.docstring.value += f"\n\nAttributes:{rows}"
            for field in described:
                field.docstring = None


def _text(field: griffe.Attribute) -> str:
    return field.docstring.value if field.docstring else ""

"""A griffe extension: the comment after a field, where its unit stands, is the field's documentation."""

from typing import Any

import griffe


class CommentsAsDocumentation(griffe.Extension):
    """`density: Float[Array, ""]  # [kg/m3]` is documented as [kg/m3]."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Take the comment on the line that ends the field."""
        if attr.docstring is None and attr.endlineno:
            line = attr.lines_collection[attr.filepath][attr.endlineno - 1]
            _, found, comment = line.partition("  # ")
            if found and not comment.startswith("noqa"):
                attr.docstring = griffe.Docstring(comment.strip(), parent=attr)

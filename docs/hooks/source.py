"""Replaces `source: touchdown.module.function` in a page by the source of that function.

So a page shows the code that runs; a function that does not exist fails the build.
"""

import ast
import inspect
import pkgutil
import re
import textwrap
from typing import Any


def on_page_markdown(markdown: str, **_: Any) -> str:
    """MkDocs calls this with each page's text."""
    return re.sub(r"^source: (\S+)$", lambda match: _block(match[1]), markdown, flags=re.MULTILINE)


def _block(name: str) -> str:
    code = textwrap.dedent(inspect.getsource(pkgutil.resolve_name(name)))
    function = ast.parse(code).body[0]
    if not isinstance(function, ast.FunctionDef):
        raise TypeError(f"{name} is not a function")
    arguments = function.args.posonlyargs + function.args.args + function.args.kwonlyargs
    names = ", ".join(argument.arg for argument in arguments if argument.arg != "self")
    first = function.body[1 if ast.get_docstring(function) else 0]
    body = "\n".join(code.splitlines()[first.lineno - 1 :])
    return f"```python\ndef {function.name}({names}):\n{body}\n```\n\n[`{name}`][{name}]"

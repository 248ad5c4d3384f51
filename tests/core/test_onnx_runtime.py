"""onnxruntime is imported without its telemetry."""

import os
import sys
from types import ModuleType

import pytest

from touchdown.core import onnx_runtime
from touchdown.core.errors import UserError


@pytest.mark.parametrize(("set_to", "seen"), [(None, "1"), ("0", "0")])
def test_telemetry_is_off_before_the_first_import_unless_it_is_asked_for(
    tmp_path, monkeypatch, set_to, seen
):
    code = "import os; switch = os.environ.get('ORT_DISABLE_TELEMETRY')"
    (tmp_path / "onnxruntime.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "onnxruntime", ModuleType("forgotten at the end"))
    del sys.modules["onnxruntime"]
    monkeypatch.setattr(os, "environ", {} if set_to is None else {"ORT_DISABLE_TELEMETRY": set_to})
    assert onnx_runtime.load("model.onnx").switch == seen


def test_without_it_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(UserError, match=r"^model.onnx: needs onnxruntime, .*\[onnx\]"):
        onnx_runtime.load("model.onnx")

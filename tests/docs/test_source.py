"""A page shows the code that runs."""

import pytest
import source

PAGE = "Before.\n\nsource: touchdown.agents.td.q_error\n\nAfter."


def test_a_line_that_names_a_function_becomes_its_code_without_the_docstring():
    page = source.on_page_markdown(PAGE)
    assert "def q_error(q_tm1, a_tm1, r_t, discount_t, q_t):\n    return r_t +" in page
    assert "Args:" not in page
    assert "[`touchdown.agents.td.q_error`][touchdown.agents.td.q_error]" in page
    assert page.startswith("Before.")
    assert page.endswith("After.")


def test_a_function_that_does_not_exist_fails_the_build():
    with pytest.raises(AttributeError, match="no_error"):
        source.on_page_markdown("source: touchdown.agents.td.no_error")


def test_a_class_is_refused():
    with pytest.raises(TypeError, match="GreedyPolicy is not a function"):
        source.on_page_markdown("source: touchdown.agents.greedy.GreedyPolicy")

"""Codes, sentences and pages of errors agree."""

from __future__ import annotations

import string

import pytest

from dmc41x3.i18n import LANGUAGES
from maya_un import errors
from maya_un.errors import MachineError, MayaError, RequestError
from tests.conventions.source import ROOT

LEAVES = list(errors.by_code().values())


def fields(sentence: str) -> set[str]:
    return {field for _, field, _, _ in string.Formatter().parse(sentence) if field is not None}


def branches(branch: type[MayaError]) -> list[type[MayaError]]:
    return [branch, *(found for child in branch.__subclasses__() for found in branches(child))]


def test_no_code_is_given_twice() -> None:
    coded = [found for found in branches(MayaError) if found.code]
    assert len({found.code for found in coded}) == len(coded)


def test_an_error_belongs_to_one_branch_and_one_family() -> None:
    assert [leaf for leaf in LEAVES if issubclass(leaf, RequestError) == issubclass(leaf, MachineError)] == []
    assert [leaf for leaf in LEAVES if not 1 <= leaf.code // 1000 <= 5] == []


def test_a_sentence_names_required_details_and_all_of_them() -> None:
    for leaf in LEAVES:
        assert fields(leaf.en) == {name for name, required in leaf.declared.items() if required}, leaf


def test_all_languages_name_the_same_details() -> None:
    for leaf in LEAVES:
        assert len({frozenset(fields(leaf.template(language))) for language in LANGUAGES}) == 1, leaf


def test_a_sentence_ends_like_one() -> None:
    sentences = [leaf.template(language) for leaf in LEAVES for language in LANGUAGES]
    assert [sentence for sentence in sentences if not sentence.endswith((".", ")"))] == []


def test_every_code_is_in_the_reference() -> None:
    page = (ROOT / "docs" / "reference" / "errors.md").read_text(encoding="utf-8")
    assert [code for code, leaf in errors.by_code().items() if f"### {code} {leaf.__name__}" not in page] == []


def test_a_branch_cannot_be_raised() -> None:
    with pytest.raises(TypeError, match="branch"):
        raise RequestError

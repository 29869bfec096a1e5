"""Tests of the messages for validation errors: place, value, reason and allowed values."""

from typing import Annotated, Literal

import pytest
from pydantic import Field, TypeAdapter, ValidationError

from pneuforce.support.toml_sections import Section
from pneuforce.support.validation_errors import MAX_VALUE_CHARACTERS, format_errors, format_input, model_at


class Circle(Section):
    kind: Literal["circle"]
    radius_mm: float = Field(ge=1, le=20.0)


class Square(Section):
    kind: Literal["square"]
    side_mm: float = Field(ge=1, le=5)


Shape = Annotated[Circle | Square, Field(discriminator="kind")]


class Drawing(Section):
    shape: list[Shape] = Field(default_factory=list)
    best: Shape | None = None
    scale: Literal["small", "large"] = "small"
    title: str = "none"
    lines: list[Annotated[int, Field(ge=1, le=9)]] = Field(default_factory=list)


def errors_of(tables, kind=Drawing):
    with pytest.raises(ValidationError) as error:
        TypeAdapter(kind).validate_python(tables)
    return format_errors(error.value, kind)


@pytest.mark.parametrize(
    ("tables", "facts"),
    [
        ({"titel": "x"}, ("titel: ", "unknown key", "shape, best, scale, title, lines")),
        ({"shape": [{"kind": "circle"}]}, ("shape.0.circle.radius_mm: is missing",)),
        ({"shape": [{"kind": "circle", "radius_mm": 30.0}]}, ("radius_mm = 30.0: ", "; allowed: 1 to 20")),
        ({"best": {"kind": "square", "side_mm": 9.0}}, ("best.square.side_mm = 9.0: ", "; allowed: 1 to 5")),
        ({"best": {"kind": "square", "side": 9.0}}, ("best.square.side: ", "known here: kind, side_mm")),
        (
            {"shape": [{"kind": "star"}]},
            ("shape.0, kind = 'star': unknown value; allowed: 'circle', 'square'",),
        ),
        ({"shape": [{}]}, ("shape.0: ", "the key kind")),
        ({"scale": "huge"}, ("scale = 'huge': ", "; allowed: small, large")),
        ({"title": 5}, ("title = 5: ", "; allowed: text")),
        ({"lines": [3, 12]}, ("lines.1 = 12: ", "; allowed: 1 to 9")),
    ],
)
def test_an_error_names_place_value_and_allowed_values(tables, facts):
    message = "\n".join(errors_of(tables))
    assert [fact for fact in facts if fact not in message] == []


def test_each_wrong_value_has_its_own_sentence():
    assert len(errors_of({"scale": "huge", "title": 5, "colour": 1})) == 3


def test_a_union_can_be_validated_by_itself():
    (message,) = errors_of({"kind": "circle", "radius_mm": 0.5}, Shape)
    assert message.startswith("circle.radius_mm = 0.5: ")
    assert message.endswith("; allowed: 1 to 20")


def test_the_model_at_a_location_is_found_in_lists_unions_and_optional_values():
    assert model_at(Drawing, ("shape", 3, "square")) is Square
    assert model_at(Drawing, ("best", "circle")) is Circle
    assert model_at(Drawing, ("title",)) is None
    assert model_at(Drawing, ("missing", 1)) is None


def test_a_long_value_is_cut():
    assert format_input("x" * 500) == "'" + "x" * (MAX_VALUE_CHARACTERS - 1) + "…"
    assert format_input(10**5000) == "a number with thousands of digits"

import pytest

from results.slugs import short, words


@pytest.mark.parametrize(
    ("slug", "values"),
    [
        ("twist=90deg_corner=lower-left_frequency=5Hz", "90deg lower-left 5Hz"),
        ("twist=-45deg_root_angle=90deg", "-45deg 90deg"),
        ("frequency=5Hz", "5Hz"),
        ("topology=two_hinges", "two_hinges"),
        ("phi 45 deg: twist=-45deg_root_angle=90deg", "phi 45 deg: -45deg 90deg"),
        ("single", "single"),
        ("not published", "not published"),
    ],
)
def test_tables_show_the_values_alone(slug, values):
    assert short(slug) == values


def test_values_by_name():
    assert words("twist=-45deg_root_angle=90deg") == {"twist": "-45deg", "root_angle": "90deg"}
    assert words("single") == {}

"""Materials, their mixing, and the messages of what is missing or wrong."""

from math import sqrt

import numpy as np
import pytest

from barchan.errors import MaterialError
from barchan.laws import hertz_mindlin, linear
from barchan.laws.law import Property, law
from barchan.materials import Material, Materials

pytestmark = pytest.mark.nojit

STEEL = {"kn": 200.0, "kt": 50.0, "gamma_n": 4.0, "gamma_t": 1.0, "friction": 0.2}
RUBBER = {"kn": 2.0, "kt": 2.0, "gamma_n": 9.0, "gamma_t": 4.0, "friction": 0.8}


def two():
    return Materials([Material("steel", density=8.0, **STEEL), Material("rubber", density=1.0, **RUBBER)])


def column(materials, law, a, b):
    """Pair parameters by name."""
    table = materials.table(law)
    return dict(zip(law.parameters, table[: len(law.parameters), a * len(materials) + b]))


def test_pairs_have_the_geometric_mean_and_are_symmetric():
    mixed = column(two(), linear, 0, 1)
    assert mixed == pytest.approx({name: sqrt(STEEL[name] * RUBBER[name]) for name in STEEL})
    assert column(two(), linear, 1, 0) == mixed


def test_a_pair_of_one_material_has_its_values_to_the_bit():
    """Equal values are not mixed: a square may overflow, or lose digits where numbers are tiny."""
    odd = {**STEEL, "kn": 1e200, "kt": 0.1 + 0.2, "friction": 1.0 / 3.0, "gamma_t": 1e-160}
    assert column(Materials(Material("odd", **odd)), linear, 0, 0) == odd


def test_moduli_combine_by_contact_mechanics():
    soft, hard = (
        {"youngs_modulus": 10.0, "poisson_ratio": 0.3, "friction": 0.4},
        {"youngs_modulus": 1e12, "poisson_ratio": 0.2, "friction": 0.4},
    )
    mixed = column(Materials([Material("soft", **soft), Material("hard", **hard)]), hertz_mindlin, 0, 1)
    assert mixed["E_eff"] == pytest.approx(10.0 / (1.0 - 0.09), rel=1e-9), "against something rigid: E / (1 - nu^2)"
    assert mixed["G_eff"] == pytest.approx(10.0 / 2.6 / (2.0 - 0.3), rel=1e-9), "and G / (2 - nu)"
    assert mixed["alpha"] == 0.0, "restitution defaults to 1: no damping"


def test_shear_modulus_may_stand_for_youngs_modulus():
    by_shear = Material("a", shear_modulus=3.0, poisson_ratio=0.25, friction=0.1)
    assert by_shear.properties["youngs_modulus"] == 7.5
    with pytest.raises(MaterialError, match="'a': shear_modulus needs poisson_ratio"):
        _ = Material("a", shear_modulus=3.0).properties
    with pytest.raises(MaterialError, match=r"shear_modulus = -3.0 .* > 0"):
        _ = Material("a", shear_modulus=-3.0, poisson_ratio=0.25).properties


@pytest.mark.parametrize("order", [("steel", "rubber"), ("rubber", "steel"), (0, 1)])
def test_set_pair_overrides_that_pair_only(order):
    materials = two()
    before = materials.table(linear)
    materials.set_pair(*order, friction=0.05, kn=33.0)
    after = materials.table(linear)
    mixed = column(materials, linear, 0, 1)
    assert (mixed["friction"], mixed["kn"]) == (0.05, 33.0)
    assert mixed["kt"] == pytest.approx(10.0), "what is not given is still mixed"
    assert column(materials, linear, 1, 0) == mixed
    assert (after[:, [0, 3]] == before[:, [0, 3]]).all(), "pairs of one material are as before"


@pytest.mark.parametrize("named", ["rubber", 1, np.int64(1), Material("rubber")])
def test_materials_are_found_by_name_number_or_object(named):
    assert two().index(named) == 1


@pytest.mark.parametrize("unknown", ["wood", 2, -1, True, None])
def test_an_unknown_material_is_named_with_those_that_exist(unknown):
    with pytest.raises(MaterialError, match=r"no material .* there are: steel, rubber"):
        two().index(unknown)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("kn", 0.0, "> 0"),
        ("kn", -1.0, "> 0"),
        ("friction", -0.1, ">= 0"),
        ("kt", float("nan"), "> 0"),
        ("kt", float("inf"), "> 0"),
        ("friction", "rough", ">= 0"),
        ("friction", None, None),
    ],
)
def test_a_bad_value_is_named_with_material_dimension_and_what_is_allowed(name, value, allowed):
    materials = Materials(Material("steel", **{**STEEL, name: value}))
    with pytest.raises(MaterialError) as caught:
        materials.table(linear)
    text = str(caught.value)
    assert "'steel'" in text and name in text
    if value is None:
        assert "not given" in text and linear.properties[name].dimension in text
    else:
        assert repr(value) in text and allowed in text and f"[{linear.properties[name].dimension}]" in text


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("restitution", 0.0, "> 0 and <= 1"),
        ("restitution", 1.2, "> 0 and <= 1"),
        ("poisson_ratio", 0.6, "> -1 and <= 0.5"),
    ],
)
def test_bounds_on_both_sides_are_told(name, value, allowed):
    good = {"youngs_modulus": 10.0, "poisson_ratio": 0.3, "friction": 0.4}
    with pytest.raises(MaterialError, match=f"{name} = {value} .*{allowed}"):
        Materials(Material("glass", **{**good, name: value})).table(hertz_mindlin)


def test_a_missing_property_names_material_property_dimension_and_law():
    with pytest.raises(MaterialError, match=r"'steel'.*law 'linear' needs friction \[1\]"):
        Materials(Material("steel", kn=1.0, kt=1.0)).table(linear)


def test_an_error_of_one_material_names_it_once():
    with pytest.raises(MaterialError, match=r"^material 'steel': law 'linear' needs friction"):
        Materials(Material("steel", kn=1.0, kt=1.0)).table(linear)
    with pytest.raises(MaterialError, match=r"^materials 'steel' and 'wood': law 'linear' needs kt"):
        Materials([Material("steel", **STEEL), Material("wood", kn=1.0, friction=0.1)]).table(linear)


def test_a_poisson_ratio_is_checked_before_it_is_used():
    with pytest.raises(MaterialError, match=r"material 'glass': poisson_ratio = 'much' \[1\]"):
        Materials(Material("glass", shear_modulus=1.0, poisson_ratio="much", friction=0.1)).table(hertz_mindlin)


def test_a_typo_in_a_material_or_pair_is_refused_with_what_is_known():
    with pytest.raises(
        MaterialError, match=r"material 'steel': law 'linear' knows no property 'frction'; did you mean 'friction'\?"
    ):
        Materials(Material("steel", **STEEL, frction=0.3)).table(linear)
    materials = two()
    materials.set_pair("steel", "rubber", frictoin=0.3)
    with pytest.raises(MaterialError, match=r"pair 'steel' - 'rubber'.*frictoin"):
        materials.table(linear)


def test_a_mixing_rule_that_gives_nonsense_is_refused():
    @law(properties={"k": "force/length"}, mix=lambda a, b: {"k": a["k"] / 0.0 if a["k"] == 0.0 else float("inf")})
    def spring(overlap, k):
        return k * overlap, (0.0, 0.0, 0.0)

    with pytest.raises(MaterialError, match="parameter k of law 'spring' comes out as inf"):
        Materials(Material("a", k=1.0)).table(spring)


@pytest.mark.parametrize("density", [0.0, -2.0, float("nan"), "heavy"])
def test_density_must_be_positive(density):
    with pytest.raises(MaterialError, match=r"material 'a': density = .* \[mass/length\^3\].* > 0"):
        Material("a", density=density)


def test_names_must_tell_materials_apart():
    with pytest.raises(MaterialError, match="a name of its own"):
        Materials([Material("a"), Material("a")])
    with pytest.raises(MaterialError, match="at least one"):
        Materials([])


def test_what_was_given_cannot_be_changed_behind_the_table():
    with pytest.raises(TypeError):
        Material("a", kn=1.0).given["kn"] = 2.0


def test_describe_holds_all_that_was_given():
    materials = two()
    materials.set_pair("rubber", "steel", friction=0.5)
    told = materials.describe()
    again = Materials([Material(**one) for one in told["materials"]])
    for pair in told["pairs"]:
        again.set_pair(**pair)
    assert (again.table(linear) == materials.table(linear)).all()


def test_property_defaults_fill_what_is_not_given():
    assert Property("1", default=0.5).check("x", 0.25, "here") == 0.25
    assert column(Materials(Material("bare", kn=1.0, kt=1.0, friction=0.1)), linear, 0, 0)["gamma_n"] == 0.0

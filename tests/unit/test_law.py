"""The declaration of a law: what it reads, remembers and needs, and what is refused."""

from math import pi

import pytest

import barchan as bc
from barchan.errors import LawError, SceneError
from barchan.laws import SHIPPED
from barchan.laws.law import QUANTITIES, law, mix_by_rule

pytestmark = pytest.mark.nojit

ZERO = (0.0, 0.0, 0.0)


def test_the_arguments_declare_what_a_law_reads():
    @law(properties={"stiffness": "force/length", "age": "time"}, history={"bonded": 1, "slip": 3}, lever="lens")
    def sticky(normal, overlap, tangential_velocity, dt, stiffness, slip, bonded):
        """Sticks."""
        return stiffness * overlap, ZERO, bonded, slip

    assert sticky.name == "sticky" and sticky.__doc__ == "Sticks."
    assert sticky.quantities == ("normal", "overlap", "tangential_velocity", "dt")
    assert sticky.parameters == ("stiffness",)
    assert (sticky.history, sticky.history_width, sticky.lever) == ({"bonded": 1, "slip": 3}, 4, "lens")
    assert sticky(ZERO, 0.5, ZERO, 0.1, 4.0, ZERO, 1.0) == (2.0, ZERO, 1.0, ZERO), "called, it is the plain function"


def test_ghost_fields_are_those_that_the_law_reads():
    """Too few would be stale numbers at the border of ranks; too many would be sent for nothing."""

    def reads(*arguments):
        namespace = {}
        exec(f"def f({', '.join(arguments)}): return 0.0, (0.0, 0.0, 0.0)", namespace)
        return set(law()(namespace["f"]).reads)

    assert reads("overlap", "normal", "distance") == {"position"}
    assert reads("normal_velocity") == reads("normal_half") == {"position", "velocity"}
    assert reads("relative_omega") == {"position", "velocity", "omega"}
    assert reads("tangential_velocity") == reads("slip_velocity_half") == {"position", "velocity", "omega"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"history": {"slip": 3}}, r"law 'odd': history \['slip'\] is declared but is no argument"),
        ({"history": {"kn": 2}}, r"law 'odd': history \{'kn': 2\} must be 1 .* or 3"),
        ({"couple": "yes", "properties": {"kn": "1"}}, "law 'odd': couple = 'yes' must be True or False"),
        ({"adhesive": 1, "properties": {"kn": "1"}}, "law 'odd': adhesive = 1 must be True or False"),
        ({"lever": "long", "properties": {"kn": "1"}}, "law 'odd': lever = 'long'; it must be 'radius' or 'lens'"),
        ({}, r"law 'odd': argument\(s\) \['kn'\] are no quantity .* Quantities: overlap, distance, normal"),
    ],
)
def test_a_declaration_that_does_not_fit_is_refused_at_once(options, message):
    with pytest.raises(LawError, match=message) as caught:

        @law(**options)
        def odd(overlap, kn):
            return kn * overlap, ZERO

    assert isinstance(caught.value, SceneError) and isinstance(caught.value, ValueError)


@pytest.mark.parametrize(
    "options",
    [
        {"properties": {"distance": "length", "kn": "force/length"}},  # the loop would pass the distance of the centres
        {"properties": {"kn": "force/length"}, "history": {"distance": 1}},
        {"properties": {"kn": "force/length"}, "history": {"kn": 1}},  # parameter or memory?
    ],
)
def test_a_name_that_means_two_things_is_refused(options):
    """Silently taking one of the meanings would be a wrong law."""
    with pytest.raises(LawError, match=r"distance|kn"):

        @law(**options)
        def shadow(overlap, distance, kn):
            return kn * overlap * distance, ZERO, 0.0


def test_a_mix_that_forgets_a_parameter_is_refused():
    @law(properties={"kn": "force/length"}, mix=lambda a, b: {"stiffness": a["kn"]})
    def forgotten(overlap, stiffness, cohesion):
        return stiffness * overlap - cohesion, ZERO

    with pytest.raises(LawError, match=r"law 'forgotten': its mix\(\) returns no \['cohesion'\]"):
        forgotten.pair_parameters({"kn": 1.0}, {"kn": 1.0}, "here")


@pytest.mark.parametrize(
    ("mix", "message"),
    [
        (lambda a, b: {"kn": a["km"]}, "its mix\\(\\) fails with KeyError: 'km', for here"),
        (lambda a, b: None, r"its mix\(\) fails with AttributeError"),
        (lambda a, b: {"kn": "hard"}, r"its mix\(\) fails with ValueError"),
    ],
)
def test_a_mix_that_stumbles_is_named(mix, message):
    @law(properties={"kn": "force/length"}, mix=mix)
    def spring(overlap, kn):
        return kn * overlap, ZERO

    with pytest.raises(LawError, match=f"law 'spring': {message}"):
        spring.pair_parameters({"kn": 1.0}, {"kn": 1.0}, "here")


def test_mixing_rule_is_symmetric_and_leaves_equal_values_alone():
    assert mix_by_rule({"x": 1e-170}, {"x": 1e-170}) == {"x": 1e-170}
    assert mix_by_rule({"x": 3.0}, {"x": 12.0}) == mix_by_rule({"x": 12.0}, {"x": 3.0}) == {"x": 6.0}
    assert mix_by_rule({"x": 0.0}, {"x": 12.0}) == {"x": 0.0}, "what one side lacks, the pair lacks"


def contact_values(entry, **changed):
    """Numbers of a sliding, damped contact for a shipped law."""
    values = {
        "overlap": 0.02,
        "distance": 1.98,
        "normal": (1.0, 0.0, 0.0),
        "normal_half": (0.8, 0.6, 0.0),
        "normal_velocity": -0.1,
        "tangential_velocity": (0.0, 0.3, 0.1),
        "slip_velocity_half": (-0.18, 0.24, 0.1),
        "relative_omega": (0.3, -0.2, 0.4),
        "radius_first": 1.0,
        "radius_second": 1.0,
        "radius_eff": 0.5,
        "mass_eff": 2.0,
        "dt": 0.01,
        "kn": 100.0,
        "kt": 50.0,
        "gamma_n": 1.0,
        "gamma_t": 1.0,
        "friction": 0.5,
        "E_eff": 100.0,
        "G_eff": 40.0,
        "alpha": 0.3,
        "slip": (0.0, 0.01, -0.02),
        "shear": (0.0, -0.1, 0.2),
        "work_of_adhesion": 1e-3,
        "adhesion": 1e-2,
        "rolling_friction": 0.1,
        "twisting_friction": 0.2,
        "rolling_damping": 0.3,
        "rolled": (0.0, 0.001, -0.002),
        "twisted": 0.002,
    }
    values |= changed
    names = (*entry.quantities, *entry.parameters, *entry.history)
    return {name: values[name] for name in names}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_laws_push_apart_and_keep_friction_in_the_tangent_plane(name):
    entry = SHIPPED[name]
    values = contact_values(entry)
    pressing, tangential, *_ = entry(**values)
    adhesion = {"dmt": 2.0 * pi * values.get("work_of_adhesion", 0.0), "jkr": 1.5 * 100.0 * values.get("adhesion", 0.0) ** 2}
    carried = pressing + adhesion.get(name, 0.0) * 0.5  # adhesion presses as a load does
    assert entry.name == name and pressing > 0.0
    assert abs(tangential[0]) < 1e-15, "no part along the normal"
    size = sum(t * t for t in tangential) ** 0.5
    assert 0.0 < size <= 0.5 * carried * (1.0 + 1e-12)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_laws_without_friction_have_no_tangential_force_and_no_nan(name):
    entry = SHIPPED[name]
    values = contact_values(entry, friction=0.0)
    pressing, tangential, *rest = entry(**values)
    memory = rest[entry.couple]
    assert tangential == pytest.approx(ZERO, abs=1e-15) and all(m == m for m in memory) and pressing > 0.0
    resting = contact_values(entry, friction=0.0, slip=ZERO, shear=ZERO, tangential_velocity=ZERO, slip_velocity_half=ZERO)
    assert entry(**resting)[1] == pytest.approx(ZERO, abs=0.0), "0/0 of no force and no limit"


def test_quantities_have_a_width_a_dimension_and_a_meaning():
    for name, (width, dimension, meaning) in QUANTITIES.items():
        assert width in (1, 3) and dimension and meaning, name


def test_the_decorator_needs_its_brackets():
    """Without them the function would be taken for the properties."""
    with pytest.raises(LawError, match=r"law <function .*forgot.*: the decorator needs brackets: @barchan\.law\(properties="):

        @law
        def forgot(overlap):
            return overlap, ZERO


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"properties": {"kn": "force/lenght"}},
            "law 'odd', property kn: .*'force/lenght' has 'lenght' in it; did you mean 'length'",
        ),
        ({"properties": {"kn": "N/m"}}, "law 'odd', property kn: .* has 'N' in it; known are: length, time, mass, force"),
        ({"properties": {"kn": "force//length"}}, "law 'odd', property kn: dimension 'force//length' cannot be read"),
        ({"properties": {"kn": bc.Property("forse/length")}}, "law 'odd', property kn: .* did you mean 'force'"),
        ({"properties": {"kn": 3.0}}, "law 'odd', property kn: its dimension 3.0 must be text"),
        ({"properties": ["kn"]}, r"law 'odd': properties = \['kn'\] must map names"),
        ({"properties": {1: "1"}}, "law 'odd': properties = {1: '1'} must map names"),
        ({"properties": {"kn": "1"}, "history": ["slip"]}, r"law 'odd': history = \['slip'\] must map names"),
        ({"history": {"kn": True}}, "law 'odd': history {'kn': True} must be 1"),
        ({"properties": {"kn": "1"}, "mix": {"kn": 1}}, "law 'odd': mix = {'kn': 1} must be a function"),
    ],
)
def test_a_declaration_of_the_wrong_kind_is_refused_with_what_is_known(options, message):
    with pytest.raises(LawError, match=f"^{message}"):

        @law(**options)
        def odd(overlap, kn):
            return kn * overlap, ZERO


def test_what_is_no_plain_function_of_names_is_refused():
    with pytest.raises(LawError, match="must be a plain function"):
        law()(3)
    with pytest.raises(LawError, match=r"argument\(s\) \['\*rest'\] must be plain names"):
        law(mix=lambda a, b: {})(lambda overlap, *rest: (overlap, ZERO))
    with pytest.raises(LawError, match=r"argument\(s\) \['kn=1.0'\] must be plain names"):
        law(properties={"kn": "1"})(lambda overlap, kn=1.0: (overlap, ZERO))

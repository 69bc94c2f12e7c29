"""The cases: sound states, the physics they promise, and states that are made once."""

import io

import numpy as np
import pytest

from barchan.bench import cases, graded, states
from barchan.bench.observed import count_contacts
from barchan.errors import SceneError
from barchan.laws.viscoelastic import hertz, silbert
from barchan.report import Journal


@pytest.fixture
def journal():
    return Journal(stream=io.StringIO())


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Where states are kept in this test."""
    monkeypatch.setattr(states, "cache_root", lambda: tmp_path)
    return tmp_path / "bench"


def test_an_unknown_case_is_named_with_those_there_are():
    with pytest.raises(SceneError, match=r"'dens'; did you mean 'dense'.*dense-1m"):
        cases.make("dens")


def test_chute_needs_lammps(monkeypatch, journal):
    def missing():
        raise SceneError("not installed")

    monkeypatch.setattr(cases, "share_folder", missing)
    with pytest.raises(SceneError, match=r"pip install 'barchan\[test\]'"):
        cases.make("chute", journal)


@pytest.mark.parametrize("name", ["chute", "dense", "gas", "small"])
def test_case_is_sound(name, journal):
    case = cases.make(name, journal)
    assert case.name == name and case.count == {"small": 100}.get(name, 32_000)
    position = case.grains.position
    assert ((position >= case.low) & (position <= case.high)).all()
    assert list(case.skins) == sorted(case.skins) and (len(case.skins) >= 4)
    assert case.steps >= 1000 and case.rounds >= 5
    assert not case.grains.velocity[case.grains.frozen].any()


@pytest.mark.parametrize(("name", "part", "count"), [("bidisperse-10", 40, 711_657), ("dunkirk-10", 80, 712_333)])
def test_samples_of_wide_distributions_are_what_they_are_called(name, part, count, made, journal):
    """A small part of each: its grains, its ratio, its solid fraction, and nobody overlaps."""
    kind, _, ratio = name.partition("-")
    make = getattr(graded, kind)
    case = make(int(ratio), part)(journal)
    radius, volume = case.grains.radius, np.prod(case.high)
    assert case.name == name and case.count == pytest.approx(count / part, rel=0.05) and case.forced and case.ends
    assert radius.max() / radius.min() == pytest.approx(float(ratio), rel=0.15 if kind == "dunkirk" else 0.01)
    filled = {"bidisperse": 0.46, "dunkirk": 0.303}[kind]
    assert 4.0 / 3.0 * np.pi * (radius**3).sum() / volume == pytest.approx(filled, rel=0.08)
    assert count_contacts(case, {"position": case.grains.position}) == 0
    assert case.skins[0] * case.diameter == pytest.approx(0.5)


def test_mass_falls_exponentially():
    """To 1/e over 4: half of it between 1 and 1 + 4 ln 2. With so many grains in the paper's box they fill half of it."""
    radius = graded.exponential_radii(2_000_000)
    assert 2.0 * radius.max() == 50.0 and 2.0 * radius.min() == pytest.approx(1.0, rel=1e-3)
    mass = radius[radius < 25.0] ** 3
    assert mass[2.0 * radius[radius < 25.0] < 1.0 + 4.0 * np.log(2.0)].sum() == pytest.approx(0.5 * mass.sum(), rel=0.02)
    count, edge, *_ = graded.EXPONENTIAL
    assert 4.0 / 3.0 * np.pi * mass.mean() * count / edge**3 == pytest.approx(0.5, rel=0.02)


def test_gas_is_dilute_fast_and_without_overlap(journal):
    gas = cases.gas(journal, count=1000)
    volume = np.prod(np.subtract(gas.high, gas.low))
    assert (4.0 / 3.0 * np.pi * gas.grains.radius**3).sum() / volume == pytest.approx(0.05)
    assert count_contacts(gas, {"position": gas.grains.position}) == 0
    assert np.abs(gas.grains.velocity.mean(axis=0)).max() < 1e-12 < 4.0 < gas.grains.velocity.std()


def test_dense_1m_is_the_settled_flow_side_by_side_without_its_top(made, journal):
    """2 x 1 tiles, 60,000 grains of 64,000: as many contacts a grain as one tile, and no more overlap than it has."""
    case = cases.dense_1m(journal, tiles=(2, 1), count=60_000, settling=250)
    one = cases.dense(journal)
    assert case.count == 60_000 and case.high == (80.0, 40.0, 60.0)
    contacts = count_contacts(case, {"position": case.grains.position}) / case.count
    assert contacts == pytest.approx(count_contacts(one, {"position": one.grains.position}) / one.count, rel=0.05)
    assert (case.grains.position[:, 0] < 40.0).sum() == 30_000, "as many from each tile"
    assert np.isin(case.grains.velocity, one.grains.velocity).all()
    again = cases.rebuild(journal, tiles=(2, 1), count=60_000, settling=250)
    assert np.array_equal(again.grains.position, case.grains.position) and again.forced
    assert journal.console.file.getvalue().count("making the state 'settled-250'") == 1, "once"


def test_the_avalanche_flows_and_has_the_stiffness_of_the_experiment(made, journal):
    """450 grains. The law of the case at the mean radius is the paper's."""
    case = cases.avalanche(journal, grains=450)
    grains, moving = case.grains, ~case.grains.frozen
    assert 400 < moving.sum() < 600 and grains.frozen.sum() > 100
    assert (grains.velocity[moving][:, 0] > 1.0).sum() > 10, "metres a second down the slope"
    radius, c = 0.5 * (grains.radius.min() + grains.radius.max()), case.constants
    contact = dict(overlap=0.01 * radius, normal=(1.0, 0.0, 0.0), normal_half=(1.0, 0.0, 0.0), normal_velocity=0.1)
    contact |= dict(tangential_velocity=(0.0, 0.2, 0.0), slip_velocity_half=(0.0, 0.2, 0.0), mass_eff=1e-5, dt=0.0)
    contact["slip"] = (0.0, 0.001 * radius, 0.0)
    ours = hertz(radius_eff=0.5 * radius, **contact, **c._asdict())
    scaled = {name: value * radius for name, value in c._asdict().items() if name != "friction"}
    paper = silbert(radius_first=radius, radius_second=radius, **contact, friction=c.friction, **scaled)
    assert ours[0] == pytest.approx(paper[0], rel=0.02) and ours[1][1] == pytest.approx(paper[1][1], rel=0.02)
    assert scaled["kn"] == pytest.approx(7849.0 * (radius / 1.06e-3) ** 2, rel=1e-3)


def test_a_damaged_state_is_made_anew(made, journal):
    def make(journal):
        return {"x": np.arange(3.0)}

    states.kept("any", make, journal)
    (path,) = made.iterdir()
    path.write_bytes(path.read_bytes()[:-40])
    assert np.array_equal(states.kept("any", make, journal)["x"], np.arange(3.0))
    assert journal.console.file.getvalue().count("making") == 2


def test_what_was_pickled_is_not_read(made, journal):
    made.mkdir()
    np.savez(made / f"any-v{states.VERSION}.npz", x=np.array([{}], dtype=object))
    assert np.array_equal(states.kept("any", lambda told: {"x": np.ones(1)}, journal)["x"], np.ones(1))

"""A measured and a simulated walk, judged by quantity, link and joint."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.sim import validation as measures
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.validation import N_HARMONICS, Tolerance
from tests.validation.walks import CYCLE_TIME, compare, szabadka, walking_log, without_supplements

LOG = walking_log(szabadka())


def test_a_log_agrees_with_itself() -> None:
    comparison = compare(LOG, LOG, CYCLE_TIME)
    # Torques are those of torque-controlled robots.
    assert [*(q.quantity for q in comparison.quantities), Quantity.TORQUE] == list(Quantity)
    assert (comparison.lag, comparison.cycles, comparison.samples) == (0.0, 3, 750)
    for judged in comparison.quantities:
        for agreement in (judged.whole, *judged.links, *judged.channels):
            assert agreement.mse == agreement.rmae == agreement.ram == 0.0
            assert agreement.tolerance is Tolerance.GREEN
            assert agreement.intensity_measured == agreement.intensity_simulated > 0.0


def test_an_error_of_one_joint_shows_at_that_joint_and_its_link_only() -> None:
    wrong = LOG.current.copy()
    wrong[:, 4] *= 1.4
    currents = compare(LOG, replace(LOG, current=wrong), CYCLE_TIME).quantity(Quantity.CURRENT)
    by_joint = {a.name: a for a in currents.channels}
    assert by_joint["left_front_femur"].rmae == pytest.approx(0.4)
    assert by_joint["left_front_femur"].tolerance is Tolerance.RED
    assert sum(a.rmae > 0.0 for a in currents.channels) == 1
    assert [a.rmae > 0.0 for a in currents.links] == [False, True, False]
    femurs = LOG.current[:, 1::3]
    assert currents.links[1].rmae == pytest.approx(
        measures.relative_mean_absolute_error(femurs, wrong[:, 1::3])
    )
    assert currents.links[1].ram == pytest.approx(currents.links[1].rmae)


def test_spectra_are_of_currents_at_multiples_of_the_walking_frequency() -> None:
    simulated = replace(LOG, current=0.5 * LOG.current)
    comparison = compare(LOG, simulated, CYCLE_TIME)
    for judged in comparison.quantities:
        assert len(judged.spectra) == (3 if judged.quantity is Quantity.CURRENT else 0)
    for link in comparison.quantity(Quantity.CURRENT).spectra:
        assert link.frequency == pytest.approx([k / CYCLE_TIME for k in range(N_HARMONICS + 1)])
        assert link.simulated == pytest.approx([0.5 * a for a in link.measured])
        assert link.measured[1] > link.measured[N_HARMONICS]
        assert link.spectral_error == pytest.approx(0.5)


def test_repeated_measurements_give_a_confidence_interval() -> None:
    weak, strong = (replace(LOG, current=f * LOG.current) for f in (0.9, 1.1))
    inside = compare(weak, LOG, CYCLE_TIME, repeats=[strong]).quantity(Quantity.CURRENT).whole
    mean = measures.mean_absolute(LOG.current)
    assert inside.confidence == pytest.approx((0.9 * mean, 1.1 * mean))
    assert inside.within_confidence is True
    outside = compare(weak, strong, CYCLE_TIME, repeats=[LOG]).quantity(Quantity.CURRENT).whole
    assert outside.within_confidence is False
    assert compare(weak, LOG, CYCLE_TIME).quantity(Quantity.CURRENT).whole.confidence is None


def test_a_log_within_the_tolerances_validates_the_model() -> None:
    close = replace(LOG, joint_angle=1.01 * LOG.joint_angle, current=1.08 * LOG.current)
    verdict = compare(LOG, close, CYCLE_TIME).verdict
    assert verdict.validated
    assert [gate.quantity for gate in verdict.gates] == ["q_D", "U_P", "q", "I_M", "U_S"]
    assert all(gate.passed and not gate.reason for gate in verdict.gates)


@pytest.mark.parametrize(
    ("column", "factor", "gates", "reason"),
    [
        ("desired_angle", 1.03, ["q_D"], "link 1 yellow, where a digital signal must be green"),
        ("control_voltage", 1.2, ["q_D", "U_P"], "link 3 orange, where a digital signal"),
        ("joint_angle", 1.4, ["q_D", "U_P", "q", "I_M", "U_S"], "link 2 red, unacceptable"),
        ("current", 1.6, ["q_D", "U_P", "q", "I_M", "U_S"], "link 3 purple, a serious error"),
        ("supply", 1.2, ["q_D", "U_P", "q", "I_M", "U_S"], "all orange, without repeated"),
    ],
)
def test_a_failed_gate_names_its_links_and_a_digital_one_ends_it(
    column: str, factor: float, gates: list[str], reason: str
) -> None:
    off = replace(LOG, **{column: factor * getattr(LOG, column)})
    verdict = compare(LOG, off, CYCLE_TIME).verdict
    assert not verdict.validated
    assert [gate.quantity for gate in verdict.gates] == gates
    (failed,) = [gate for gate in verdict.gates if not gate.passed]
    assert failed.quantity.column == column
    assert reason in failed.reason


def test_an_orange_signal_is_validated_inside_the_confidence_interval_alone() -> None:
    weak, strong = (replace(LOG, current=f * LOG.current) for f in (0.8, 1.2))
    inside = compare(weak, LOG, CYCLE_TIME, repeats=[strong])
    assert inside.quantity(Quantity.CURRENT).whole.tolerance is Tolerance.ORANGE
    assert inside.verdict.validated
    outside = compare(LOG, strong, CYCLE_TIME, repeats=[weak]).verdict
    assert "link 1 orange, outside CONF" in outside.gates[3].reason


def test_what_was_not_measured_is_not_judged() -> None:
    comparison = compare(without_supplements(LOG), LOG, CYCLE_TIME, repeats=[LOG])
    assert [judged.quantity for judged in comparison.quantities] == [
        quantity for quantity in Quantity if not quantity.optional
    ]
    with pytest.raises(KeyError):
        comparison.quantity(Quantity.BODY_ACCELERATION)
    partly = compare(LOG, LOG, CYCLE_TIME, repeats=[without_supplements(LOG)])
    assert partly.quantity(Quantity.POTENTIOMETER).whole.confidence is None
    assert partly.quantity(Quantity.CURRENT).whole.confidence is not None


def test_potentiometers_are_compared_by_joint_whatever_joints_have_one() -> None:
    joints = LOG.joints
    every = replace(LOG, potentiometer_joints=joints, potentiometer=LOG.desired_angle)
    judged = compare(LOG, every, CYCLE_TIME).quantity(Quantity.POTENTIOMETER)
    assert [a.name for a in judged.channels] == list(LOG.potentiometer_joints)
    assert judged.whole.rmae == 0.0


def test_the_sum_of_motor_currents_is_compared_with_the_batterys() -> None:
    battery = compare(LOG, replace(LOG, current=0.9 * LOG.current), CYCLE_TIME).battery
    assert battery.motors.rmae == pytest.approx(0.1)
    assert battery.measured is not None and battery.simulated is not None
    assert battery.measured.rmae == pytest.approx(0.25)
    assert battery.simulated.rmae == pytest.approx(0.125)
    assert compare(without_supplements(LOG), LOG, CYCLE_TIME).battery.measured is None


def test_means_by_phase_are_those_of_every_cycle() -> None:
    rows = np.arange(30)
    signal = np.column_stack([rows % 10, rows % 10 == 3]).astype(np.float64)
    means = measures.phase_means(signal, 10.0, 5)
    np.testing.assert_allclose(means[:, 0], [0.5, 2.5, 4.5, 6.5, 8.5])
    np.testing.assert_allclose(means[:, 1], [0.0, 0.5, 0.0, 0.0, 0.0])


def test_infinite_errors_are_null_in_json() -> None:
    silent = replace(LOG, supply=np.zeros_like(LOG.supply))
    text = compare(silent, LOG, CYCLE_TIME).model_dump_json()
    supply = next(q for q in json.loads(text)["quantities"] if q["quantity"] == "U_S")
    assert supply["whole"]["rmae"] is None
    assert supply["whole"]["tolerance"] == "purple"

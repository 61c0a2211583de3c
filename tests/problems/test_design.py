"""The 109-variable problem: its table, its scaling, and which quantity feels which."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.config import load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable

# The published table: name, scalars, and bounds where the study's scripts give them (lower, upper, unit of the bounds).
RPM, DEGREE = math.pi / 30.0, math.pi / 180.0
TABLE = {
    "rotor_radius": (9, "m", ([1.2] * 8 + [1.096], [1.8] * 8 + [1.644])),
    "blade_twist": (36, "rad", (3.0 * DEGREE, 85.0 * DEGREE)),
    "blade_chord": (18, "m", (0.02, 0.5)),
    "motor_length": (9, "m", None),
    "motor_diameter": (9, "m", None),
    "wing_area": (1, "m^2", (13.9355, 23.2258)),
    "wing_aspect_ratio": (1, "1", (9.0, 15.0)),
    "wing_twist": (5, "rad", None),
    "tail_area": (1, "m^2", (1.85806, 3.71612)),
    "tail_aspect_ratio": (1, "1", (3.5, 7.0)),
    "tail_position": (1, "m", None),
    "battery_mass": (1, "kg", (650.0, 1600.0)),
    "battery_position": (1, "m", (2.85, 3.5)),
    "lift_rotor_speed": (8, "rad/s", (500.0 * RPM, 1800.0 * RPM)),
    "pusher_speed": (2, "rad/s", (1200.0 * RPM, 2500.0 * RPM)),
    "pitch": (2, "rad", (-10.0 * DEGREE, 10.0 * DEGREE)),
    "tail_deflection": (2, "rad", (-12.0 * DEGREE, 12.0 * DEGREE)),
    "cruise_altitude": (1, "m", None),
    "climb_end_altitude": (1, "m", None),
}
PORT_STARBOARD = {"front_outer": (0, 6), "rear_outer": (1, 7), "front_inner": (2, 4), "rear_inner": (3, 5)}


def spread(values, counts):
    """Each value repeated as often as its block has scalars."""
    return torch.tensor(values, dtype=torch.float64).repeat_interleave(torch.tensor(counts))


def half_ranges(problem):
    return torch.cat([0.5 * (v.upper_tensor - v.lower_tensor).flatten() for v in problem.variables])


@pytest.fixture(scope="module")
def jacobian(problem):
    """Objective (first) and constraints in engineering units over physical variables, at the start."""
    scales = spread([c.scale for c in problem.constraints], problem.row_sizes)

    def values(x):
        objective, constraints = problem.evaluate(x)
        return torch.cat([(objective * problem.objective.scale)[None], constraints * scales])

    return torch.autograd.functional.jacobian(values, problem.x0) / half_ranges(problem)


def columns(problem, name):
    first = 0
    for variable in problem.variables:
        if variable.name == name:
            return slice(first, first + variable.count)
        first += variable.count
    raise KeyError(name)


def rows(problem, name):
    first = 1
    for constraint, size in zip(problem.constraints, problem.row_sizes, strict=True):
        if constraint.name == name:
            return slice(first, first + size)
        first += size
    raise KeyError(name)


def test_the_problem_has_the_published_109_variables(problem):
    ours = {v.name: (v.count, v.unit) for v in problem.variables}
    assert ours == {name: (count, unit) for name, (count, unit, _) in TABLE.items()}
    assert problem.size == sum(ours[name][0] for name in ours) == 109
    assert set(ours) == set(problem.unpack(problem.x0).values())


def test_bounds_are_those_of_the_published_scripts(problem):
    for variable in problem.variables:
        bounds = TABLE[variable.name][2]
        if bounds is not None:
            lower, upper = (torch.as_tensor(end, dtype=torch.float64) for end in bounds)
            shape = (-1, *[1] * (len(variable.size) - 1)) if lower.dim() else ()
            torch.testing.assert_close(
                variable.lower_tensor, lower.reshape(shape).expand(variable.size), rtol=1e-12, atol=0.0
            )
            torch.testing.assert_close(
                variable.upper_tensor, upper.reshape(shape).expand(variable.size), rtol=1e-12, atol=0.0
            )
        assert bool((variable.lower_tensor < variable.upper_tensor).all())
        assert all(variable.reasons), f"{variable.name}: a bound without a reason"


def test_the_problem_has_the_published_17_rows_with_their_limits(problem):
    limits = {c.name: (c.unit, c.lower, c.upper) for c in problem.constraints}
    mission = load()[1]
    slowest = mission.speed("cruise")
    inf = math.inf
    expected = {
        "trim_residual": ("1", 0.0, 0.0),
        "final_state_of_charge": ("1", 0.2, inf),
        "stall_speed": ("m/s", -inf, slowest - 5.0),
        "altitude_match": ("m", 0.0, 0.0),
        "sound_pressure_level": ("dB(A)", -inf, 67.0),
        **{f"rotor_symmetry_{place}_port": ("1", 0.0, 0.0) for place in PORT_STARBOARD},
        "tip_clearance_front": ("m", mission.requirements.rotor_tip_clearance, inf),
        "tip_clearance_rear": ("m", mission.requirements.rotor_tip_clearance, inf),
        "motor_torque_climb": ("1", -inf, 1.0),
        "motor_torque_cruise": ("1", -inf, 1.0),
        **{f"motor_symmetry_{place}_port": ("1", 0.0, 0.0) for place in PORT_STARBOARD},
    }
    assert limits == expected
    assert len(problem.constraints) == 17
    equalities = {c.name for c in problem.constraints if c.kind == "equality"}
    assert equalities == {name for name, (_, lower, upper) in expected.items() if lower == upper}


def test_scaling_takes_bounds_to_minus_and_plus_one_and_back(problem):
    for x, end in ((problem.lower, "lower"), (problem.upper, "upper")):
        for variable in problem.variables:
            value = problem.physical(x)[variable.name]
            assert value.shape == variable.size
            bound = getattr(variable, f"{end}_tensor")
            assert bool(((value - bound).abs() <= 1e-12 * variable.upper_tensor.abs()).all())


def test_scaling_round_trip_is_exact_for_random_designs(problem):
    generator = torch.Generator().manual_seed(4)
    for _ in range(20):
        x = 2.0 * torch.rand(problem.size, generator=generator, dtype=torch.float64) - 1.0
        torch.testing.assert_close(problem.scaled(problem.physical(x)), x, rtol=0.0, atol=1e-13)


def test_the_start_is_the_aircraft_of_the_vehicle_file(problem):
    vehicle, mission = load()
    design = problem.unpack(problem.x0)
    assert design.rotor_radius.tolist() == pytest.approx([rotor.radius for rotor in vehicle.rotors])
    assert design.blade_twist[8].tolist() == pytest.approx(vehicle.pushers[0].twist)
    assert design.blade_chord[0].tolist() == pytest.approx([0.3, 0.1])
    assert float(design.wing_area) == pytest.approx(19.536)
    assert (design.of_segments["lift_rotor_speed"] / RPM).tolist() == pytest.approx([1200.0] * 8)
    assert (design.of_segments["pusher_speed"] / RPM).tolist() == pytest.approx([1350.0] * 2)
    assert float(design.battery_mass) == pytest.approx(900.0)
    assert design.pitch.tolist() == pytest.approx([mission.path_angle("climb"), 0.0], abs=1e-15)
    assert [float(design.of_segments[f"{name}_altitude"]) for name in ("cruise", "climb_end")] == pytest.approx(
        [1006.0] * 2
    )


def test_gross_mass_at_the_start_is_the_published_one(problem):
    # About 7500 lb; mass check of the baseline: 3300 to 3400 kg.
    assert 3300.0 < float(problem.analyze(problem.x0).gross_mass) < 3400.0


def test_every_variable_influences_an_output(problem, jacobian):
    # Over half its range every variable moves some output by more than a thousandth (kg, m/s, dB, m or share).
    weakest = (jacobian * half_ranges(problem)).abs().amax(0)
    silent = [problem.variable_label(i) for i in (weakest < 1e-3).nonzero().flatten().tolist()]
    assert silent == []


def test_every_row_is_influenced_by_a_variable(problem, jacobian):
    assert bool((jacobian.abs().amax(1) > 1e-6).all())
    assert jacobian.shape == (1 + sum(problem.row_sizes), 109)


def test_heavier_parts_raise_the_gross_mass_kilogram_by_kilogram(problem, jacobian):
    # A kilogram of battery is carried by structure that grows with it; motors are points that only weigh.
    assert 1.0 <= float(jacobian[0, columns(problem, "battery_mass")]) < 1.5
    for name in ("motor_length", "motor_diameter", "wing_area", "wing_aspect_ratio", "tail_area"):
        assert bool((jacobian[0, columns(problem, name)] > 0.0).all()), name


def test_gross_mass_does_not_depend_on_how_the_aircraft_is_flown(problem, jacobian):
    for name in ("lift_rotor_speed", "pusher_speed", "pitch", "tail_deflection", "cruise_altitude", "blade_twist"):
        assert float(jacobian[0, columns(problem, name)].abs().max()) == 0.0, name


def test_battery_mass_buys_state_of_charge_and_rotor_speed_costs_it(problem, jacobian):
    charge = jacobian[rows(problem, "final_state_of_charge")][0]
    assert float(charge[columns(problem, "battery_mass")]) > 0.0
    assert bool((charge[columns(problem, "lift_rotor_speed")] < 0.0).all())


def test_stall_speed_falls_with_the_square_root_of_the_wing_area(problem, jacobian):
    # v ~ sqrt(W / S): dv/dS = v/2 (dW/dS / W - 1/S); the rest is the Reynolds number's, a few per cent of it.
    analysis = problem.analyze(problem.x0)
    wing = columns(problem, "wing_area")
    speed, mass = analysis.aerodynamics.stall_speed, float(analysis.gross_mass)
    expected = 0.5 * speed * (float(jacobian[0, wing]) / mass - 1.0 / 19.536)
    torch.testing.assert_close(jacobian[rows(problem, "stall_speed"), wing][:, 0], expected, rtol=0.1, atol=0.0)


def test_altitude_match_is_the_difference_of_both_altitudes(problem, jacobian):
    row = jacobian[rows(problem, "altitude_match")][0]
    assert float(row[columns(problem, "climb_end_altitude")]) == pytest.approx(1.0)
    assert float(row[columns(problem, "cruise_altitude")]) == pytest.approx(-1.0)
    assert int((row != 0.0).sum()) == 2


def test_tip_clearance_is_the_gap_between_neighbouring_disks(problem, jacobian):
    # Hubs at 5.715 and 2.58 m, two radii of 1.524 m; both move with the span, d(gap)/d(AR) = (y_out - y_in)/(2 AR).
    values = dict(zip([c.name for c in problem.constraints], problem.rows(problem.analyze(problem.x0)), strict=True))
    radius, wing = columns(problem, "rotor_radius"), columns(problem, "wing_aspect_ratio")
    for row, pairs in (("front", ((0, 2), (6, 4))), ("rear", ((1, 3), (7, 5)))):
        assert values[f"tip_clearance_{row}"].tolist() == pytest.approx([5.715 - 2.58 - 2 * 1.524] * 2, abs=1e-9)
        for line, pair in zip(jacobian[rows(problem, f"tip_clearance_{row}")], pairs, strict=True):
            assert line[radius].tolist() == pytest.approx([-1.0 if i in pair else 0.0 for i in range(9)], abs=1e-12)
            assert float(line[wing]) == pytest.approx((5.715 - 2.58) / (2.0 * 12.1423), rel=1e-9)


@pytest.mark.parametrize("place", PORT_STARBOARD)
def test_symmetry_rows_vanish_for_mirrored_rotors_and_see_every_difference(problem, jacobian, place):
    port, starboard = PORT_STARBOARD[place]
    for kind, parts in (
        ("rotor", {"rotor_radius": 1, "blade_twist": 4, "blade_chord": 2, "lift_rotor_speed": 1}),
        ("motor", {"motor_length": 1, "motor_diameter": 1}),
    ):
        block = jacobian[rows(problem, f"{kind}_symmetry_{place}_port")]
        seen = torch.zeros(109, dtype=torch.bool)
        for name, width in parts.items():
            start = columns(problem, name).start
            left = slice(start + port * width, start + (port + 1) * width)
            right = slice(start + starboard * width, start + (starboard + 1) * width)
            torch.testing.assert_close(block[:, left], -block[:, right], rtol=1e-12, atol=0.0)
            assert int(torch.linalg.matrix_rank(block[:, left])) == width
            seen[left] = seen[right] = True
        assert float(block[:, ~seen].abs().max()) == 0.0
    row = next(c for c in problem.constraints if c.name == f"rotor_symmetry_{place}_port")
    assert float(row.of(problem.analyze(problem.x0)).abs().max()) == 0.0


def test_mirrored_designs_have_equal_mass_charge_noise_and_trim(problem):
    """Swapping port and starboard values changes nothing that the symmetric rows do not see."""
    generator = torch.Generator().manual_seed(8)
    x = (problem.x0 + 0.1 * torch.randn(109, generator=generator, dtype=torch.float64)).clamp(-1.0, 1.0)
    swap = torch.tensor([6, 7, 4, 5, 2, 3, 0, 1, 8])
    values = problem.physical(x)
    mirrored = dict(values)
    for name in ("rotor_radius", "blade_twist", "blade_chord", "motor_length", "motor_diameter"):
        mirrored[name] = values[name][swap]
    mirrored["lift_rotor_speed"] = values["lift_rotor_speed"][swap[:8]]
    ours, theirs = problem.evaluate(x), problem.evaluate(problem.scaled(mirrored))
    torch.testing.assert_close(theirs[0], ours[0], rtol=1e-12, atol=0.0)
    through_charge = sum(problem.row_sizes[:5])
    torch.testing.assert_close(theirs[1][:through_charge], ours[1][:through_charge], rtol=1e-9, atol=1e-9)


def test_gradient_of_all_rows_equals_central_differences_along_random_directions(problem):
    # Fourth-order differences of step 1e-3 in scaled units: agreement to 1e-6 of each row's own size.
    generator = torch.Generator().manual_seed(9)
    x = 0.9 * problem.x0 + 0.05 * (2.0 * torch.rand(109, generator=generator, dtype=torch.float64) - 1.0)
    direction = torch.randn(109, generator=generator, dtype=torch.float64) / math.sqrt(109)

    def along(step):
        objective, constraints = problem.evaluate(x + step * direction)
        return torch.cat([objective[None], constraints])

    exact = torch.autograd.functional.jacobian(along, number(0.0))
    differences = central_difference(along, number(0.0), 1e-3)[:, 0]
    torch.testing.assert_close(exact, differences, rtol=1e-6, atol=1e-6)


def test_a_batch_of_designs_equals_a_loop(problem):
    generator = torch.Generator().manual_seed(10)
    x = (problem.x0 + 0.1 * torch.randn(3, 109, generator=generator, dtype=torch.float64)).clamp(-1.0, 1.0)
    objective, constraints = problem.evaluate(x)
    assert constraints.shape == (3, sum(problem.row_sizes))
    for i in range(3):
        one, row = problem.evaluate(x[i])
        torch.testing.assert_close(objective[i], one, rtol=1e-12, atol=0.0)
        torch.testing.assert_close(constraints[i], row, rtol=1e-9, atol=1e-10)


def test_labels_name_the_scalar_behind_an_index(problem):
    assert problem.variable_label(0) == "rotor_radius[0]"
    assert problem.variable_label(9 + 35) == "blade_twist[35]"
    assert problem.variable_label(columns(problem, "wing_area").start) == "wing_area"
    assert problem.variable_label(108) == "climb_end_altitude"
    assert problem.constraint_label(0) == "trim_residual[0]"
    assert problem.constraint_label(problem.row_sizes[0]) == "final_state_of_charge"
    with pytest.raises(IndexError):
        problem.variable_label(109)


def test_a_start_beyond_its_bounds_is_refused():
    with pytest.raises(ValueError, match=r"span = 3 m at the start is invalid: its bounds are 1 and 2 m"):
        toy_problem(Variable("span", "m", 1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        (
            "vehicle.battery.position_m.0=4.0",
            r"battery\.position_m\[0\] = 4 is invalid: it must lie between 2\.85 and 3\.5, bounds\.battery_position_m",
        ),
        (
            "vehicle.rotors.8.speed_rpm=1150",
            r"rotors\[8\]\.speed_rpm = 1150 is invalid: it must lie between 1200 and 2500, bounds\.pusher_speed_rpm",
        ),
        (
            "vehicle.rotors.8.twist_deg.0=89",
            r"rotors\[8\]\.twist_deg\[0\] = 89 is invalid: it must lie between 3 and 85, bounds\.blade_twist_deg",
        ),
        ("vehicle.bounds.wing_area_m2.upper=2", r"lower = [0-9.]+ is invalid: it must not exceed upper = 2"),
    ],
)
def test_a_start_beyond_the_files_own_bounds_is_refused_with_key_value_and_bounds(override, sentence):
    with pytest.raises(ValueError, match=sentence):
        load(overrides=[override])


def test_a_bound_moves_with_the_file():
    vehicle, mission = load(overrides=["vehicle.bounds.wing_area_m2.upper=21"])
    (area,) = (v for v in gross_weight_problem(vehicle, mission).variables if v.name == "wing_area")
    assert area.upper == 21.0


def toy_problem(*variables):
    return Problem(
        name="toy",
        formulation="toy",
        variables=variables,
        constraints=(
            Constraint("sum", "m", lambda a: a["span"] + a["chord"].sum(-1), lower=1.0, upper=4.0, scale=2.0),
            Constraint("each", "m", lambda a: a["chord"], lower=0.5),
        ),
        objective=Objective("area", "m^2", lambda a: a["span"] * a["chord"].mean(-1), scale=10.0),
        analyze_design=lambda values: values,
        complete=lambda values: values,
    )


def test_rows_and_limits_are_divided_by_their_scale():
    toy = toy_problem(Variable("span", "m", 0.0, 4.0, 3.0), Variable("chord", "m", 0.0, 1.0, [0.25, 0.75], (2,)))
    torch.testing.assert_close(toy.x0, torch.tensor([0.5, -0.5, 0.5]).double())
    objective, constraints = toy.evaluate(toy.x0)
    assert float(objective) == pytest.approx(3.0 * 0.5 / 10.0)
    assert constraints.tolist() == pytest.approx([4.0 / 2.0, 0.25, 0.75])
    assert toy.row_sizes == (1, 2)
    assert toy.constraint_lower.tolist() == [0.5, 0.5, 0.5]
    assert toy.constraint_upper.tolist() == [2.0, math.inf, math.inf]

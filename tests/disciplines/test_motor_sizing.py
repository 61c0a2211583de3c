"""Motor sizing against closed-form machine theory: shear stress, load line, similarity and what turns cannot change."""

import math
from dataclasses import fields

import pytest
import torch
from conftest import central_difference, number
from scipy.optimize import brentq

from lpc_mdo.disciplines.motor import friction_torque, operate_motor
from lpc_mdo.disciplines.motor_limits import maximum_torque
from lpc_mdo.disciplines.motor_sizing import VACUUM_PERMEABILITY, MotorParameters, size_motor

BORES = torch.tensor([0.12, 0.2, 0.3, 0.45], dtype=torch.float64)


def air_gap(bore, q):
    """Mechanical gap (m) by the design rule 0.4 x electric loading x pole pitch/(0.9e6 x flux density)."""
    return 0.4 * q.electric_loading * math.pi * bore / (2 * q.pole_pairs) / (0.9e6 * q.air_gap_flux_density)


@pytest.mark.parametrize("length", [0.04, 0.15])
def test_magnet_torque_is_the_shear_stress_of_the_air_gap(length):
    """T = (pi D^2/2) l k_w A B_1/sqrt(2): rms current sheet A times fundamental flux density, at the current limit."""
    q = MotorParameters()
    motor = size_motor(BORES, number(length))
    c = motor.circuit
    fundamental = motor.flux_density * 4 / math.pi * math.sin(0.5 * math.pi * q.magnet_arc)
    effective = length + 2 * air_gap(BORES, q)
    stress = q.winding_factor * q.maximum_electric_loading * fundamental / math.sqrt(2)
    torque = 1.5 * c.pole_pairs * c.flux_linkage * c.current_limit
    torch.testing.assert_close(torque, 0.5 * math.pi * BORES**2 * effective * stress, rtol=1e-12, atol=0.0)


def test_gap_flux_density_solves_the_magnetic_circuit_and_stays_below_the_load_line():
    """Ampere's law around a pole: magnet source = drops in magnet, gap, teeth and yoke; without iron, the load line."""
    q = MotorParameters()
    remanence = 1.2 * (1 - 0.0012 * 60)
    recoil = 1.2 / (VACUUM_PERMEABILITY * 907e3)
    densities = size_motor(BORES, number(0.1)).flux_density
    for bore, density in zip(BORES.tolist(), densities.tolist(), strict=True):
        reluctance = 1.1 * air_gap(bore, q) + 4e-3 / recoil
        load_line = remanence * 4e-3 / recoil / reluctance
        assert 0.85 * load_line < density < load_line
        pole_pitch = math.pi * bore / 12
        slot = 0.125 * bore - pole_pitch * 0.7 * 0.85 / (2 * 0.95 * 1.35)

        source = remanence * 4e-3 / recoil / VACUUM_PERMEABILITY

        def excess(b, slot=slot, pole_pitch=pole_pitch, reluctance=reluctance, source=source):
            teeth, yoke = (70 * x + 75 * (x / 1.3) ** 15 for x in (b / 0.85 * 1.7, b / 0.85 * 1.35))
            return b * reluctance / VACUUM_PERMEABILITY + teeth * slot + yoke * 0.5 * pole_pitch - source

        assert density == pytest.approx(brentq(excess, 0.0, remanence, xtol=1e-14), rel=1e-11)


def test_hot_magnets_make_less_flux_and_thick_ones_more():
    base = float(size_motor(number(0.235), number(0.065)).flux_density)
    hot = size_motor(number(0.235), number(0.065), MotorParameters(magnet_temperature=140.0))
    thick = size_motor(number(0.235), number(0.065), MotorParameters(magnet_thickness=6e-3))
    assert float(hot.flux_density) < base < float(thick.flux_density) < 1.2


def test_mass_is_linear_in_length_and_grows_with_the_square_of_the_bore():
    lengths = torch.tensor([0.05, 0.10, 0.15, 0.20], dtype=torch.float64)
    mass = size_motor(number(0.235), lengths).mass
    torch.testing.assert_close(mass.diff(), (mass[1] - mass[0]).expand(3), rtol=1e-12, atol=0.0)
    assert float(mass[0]) > float(mass[1] - mass[0])  # end windings weigh without active length
    wide = size_motor(number(0.47), lengths).mass
    # Per length; magnets are only proportional to the bore.
    assert 3.5 < float((wide[1] - wide[0]) / (mass[1] - mass[0])) < 4.0


def test_similar_machines_scale_with_the_cube_of_their_size():
    """All lengths x s at equal flux density and current sheet: mass, torque x s^3, loss x s (current density x 1/s)."""
    s = 1.7
    small = size_motor(number(0.2), number(0.08), MotorParameters(end_winding_allowance=0.02))
    rules = MotorParameters(end_winding_allowance=0.02 * s, magnet_thickness=4e-3 * s)
    large = size_motor(number(0.2 * s), number(0.08 * s), rules)

    def ratio(of):
        return float(of(large) / of(small))

    assert ratio(lambda m: m.flux_density) == pytest.approx(1.0, rel=1e-11)
    assert ratio(lambda m: m.mass) == pytest.approx(s**3, rel=1e-11)
    assert ratio(lambda m: maximum_torque(m.circuit, number(50.0))) == pytest.approx(s**3, rel=1e-9)
    assert ratio(lambda m: m.circuit.phase_resistance * m.circuit.current_limit**2) == pytest.approx(s, rel=1e-11)
    assert ratio(lambda m: m.circuit.hysteresis) == pytest.approx(s**3, rel=1e-10)
    assert ratio(lambda m: m.circuit.eddy) == pytest.approx(s**3, rel=1e-10)
    assert ratio(lambda m: m.circuit.windage) == pytest.approx(s**5, rel=1e-11)
    assert ratio(lambda m: m.circuit.inductance_q * m.circuit.current_limit / m.circuit.flux_linkage) == pytest.approx(
        1.0
    )


def test_turns_change_neither_mass_nor_loss_nor_torque():
    """Half the voltage at half the turns is the same machine."""
    whole, half = (size_motor(number(0.235), number(0.065), MotorParameters(dc_voltage=v)) for v in (800.0, 400.0))
    assert float(half.mass) == float(whole.mass)
    assert float(half.circuit.current_limit) == pytest.approx(2 * float(whole.circuit.current_limit), rel=1e-12)
    for speed in (200.0, 900.0):
        losses = [operate_motor(m.circuit, number(120.0), number(speed)).input_power for m in (whole, half)]
        torques = [maximum_torque(m.circuit, number(speed)) for m in (whole, half)]
        assert float(losses[0]) == pytest.approx(float(losses[1]), rel=1e-10)
        assert float(torques[0]) == pytest.approx(float(torques[1]), rel=1e-10)


def test_no_load_voltage_at_rated_speed_is_the_chosen_share_of_the_limit():
    motor, q = size_motor(BORES, number(0.1)), MotorParameters()
    # The shaft drives against friction, so that no current flows.
    speed = number(q.rated_speed)
    idle = operate_motor(motor.circuit, -friction_torque(motor.circuit, speed), speed)
    limit = q.dc_voltage / math.sqrt(3)
    torch.testing.assert_close(
        idle.voltage, torch.full_like(BORES, q.rated_voltage_share * limit), rtol=1e-12, atol=0.0
    )


def test_copper_loss_is_resistivity_times_volume_times_squared_current_density():
    """Copper mass / density = volume; 3/2 R I^2 = rho J^2 V with J from the current limit's electric loading."""
    q = MotorParameters()
    motor = size_motor(number(0.235), number(0.065))
    pole_pitch = math.pi * 0.235 / 12
    half_turn = 0.065 + 2 * air_gap(0.235, q) + 0.02 + 2 * pole_pitch
    yoke = pole_pitch * 0.7 * 0.85 / (2 * 0.95 * 1.35)
    slot_depth = 0.125 * 0.235 - yoke
    tooth = math.pi * 0.235 / 36 * 0.85 / (0.95 * 1.7)
    copper = 0.45 * slot_depth * (math.pi * (0.235 + slot_depth) - 36 * tooth)
    density = q.maximum_electric_loading * math.pi * 0.235 / copper
    loss = 1.5 * motor.circuit.phase_resistance * motor.circuit.current_limit**2
    assert float(loss) == pytest.approx(q.copper_resistivity * density**2 * copper * half_turn, rel=1e-12)


def test_mass_is_that_of_its_rings_teeth_and_coils():
    """Areas of circles between the diameters; stator 95 % steel, rotor solid; housing and shaft add a quarter."""
    q, bore, length = MotorParameters(), 0.235, 0.065

    def ring(outer, inner):
        return 0.25 * math.pi * (outer**2 - inner**2) * length

    gap, pole_pitch = air_gap(bore, q), math.pi * bore / 12
    yoke = pole_pitch * 0.7 * 0.85 / (2 * 0.95 * 1.35)
    outer, rotor = 1.25 * bore, bore - 2 * gap
    slot_depth, tooth = 0.5 * (outer - bore) - yoke, math.pi * bore / 36 * 0.85 / (0.95 * 1.7)
    slots = 0.25 * math.pi * ((bore + 2 * slot_depth) ** 2 - bore**2) - 36 * tooth * slot_depth
    stator = 7800 * 0.95 * (ring(outer, outer - 2 * yoke) + 36 * tooth * slot_depth * length)
    magnets = 7600 * 0.78 * ring(rotor, rotor - 8e-3)
    core = 7800 * ring(rotor - 8e-3, rotor - 8e-3 - 2 * yoke)
    coils = 8900 * 0.45 * slots * (length + 2 * gap + 0.02 + 2 * pole_pitch)
    mass = float(size_motor(number(bore), number(length)).mass)
    assert mass == pytest.approx(1.25 * (stator + magnets + core + coils), rel=1e-12)


def test_inductance_is_the_flux_linked_by_the_field_of_three_sinusoidal_currents():
    """Uniform gap: wave of magnetomotive force (3/2)(4/pi) k N/(2p) i, its flux through the gap, linked by k N."""
    q = MotorParameters(magnet_arc=1.0)
    motor = size_motor(BORES, number(0.1), q)
    gap = air_gap(BORES, q)
    area = math.pi * BORES / 12 * (0.1 + 2 * gap)  # of a pole
    magnet_flux = 2 / math.pi * (4 / math.pi * motor.flux_density) * area
    effective_turns = motor.circuit.flux_linkage / magnet_flux
    field = 1.5 * 4 / math.pi * effective_turns / 12 * VACUUM_PERMEABILITY
    magnetic_gap = 1.1 * gap + 4e-3 / (1.2 / (VACUUM_PERMEABILITY * 907e3))
    linked = effective_turns * 2 / math.pi * field / magnetic_gap * area
    torch.testing.assert_close(motor.circuit.inductance_d, 1.25 * linked, rtol=1e-12, atol=0.0)


def test_windage_is_the_friction_of_the_drum():
    """Shear stress c rho u^2/2 on the rotor's surface times its speed."""
    q = MotorParameters()
    radius = 0.5 * 0.235 - air_gap(0.235, q)
    friction = 0.005 * 0.5 * 1.2 * radius**2 * (2 * math.pi * radius * 0.065) * radius
    windage = size_motor(number(0.235), number(0.065)).circuit.windage
    assert float(windage) == pytest.approx(friction, rel=1e-12, abs=0.0)


def test_iron_loss_constants_give_the_data_sheet_of_their_steel():
    # M270-35A: at most 2.7 W/kg at 1.5 T and 50 Hz.
    q = MotorParameters()
    assert q.hysteresis_loss * 50 * 1.5**2 + q.eddy_loss * 50**2 * 1.5**2 == pytest.approx(2.7, rel=0.01)


def test_inset_magnets_make_the_direct_axis_the_one_of_lower_inductance():
    c = size_motor(BORES, number(0.1)).circuit
    assert bool((c.inductance_d < c.inductance_q).all())
    surface = size_motor(BORES, number(0.1), MotorParameters(magnet_arc=1.0)).circuit
    torch.testing.assert_close(surface.inductance_d, surface.inductance_q, rtol=1e-12, atol=0.0)


def test_specific_torque_and_efficiency_are_those_of_good_machines():
    # Traction and aerospace data sheets: 5-15 N m/kg, 92-97 %.
    motor = size_motor(number(0.235), number(0.065))
    torque = maximum_torque(motor.circuit, number(500.0))
    assert 5.0 < float(torque / motor.mass) < 15.0
    assert 0.92 < float(operate_motor(motor.circuit, 0.5 * torque, number(500.0)).efficiency) < 0.97


def test_gradient_equals_central_differences():
    def results(x):
        motor = size_motor(x[0], x[1])
        c = motor.circuit
        input_power = operate_motor(c, number(150.0), number(500.0)).input_power
        values = [motor.mass, motor.flux_density, c.phase_resistance, c.inductance_d, c.inductance_q, c.current_limit]
        return torch.log(
            torch.stack([*values, c.hysteresis, c.eddy, c.windage, maximum_torque(c, number(900.0)), input_power])
        )

    x = torch.tensor([0.235, 0.065], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(results, x)
    torch.testing.assert_close(exact, central_difference(results, x, 1e-5), rtol=1e-7, atol=1e-8)


def test_a_batch_equals_a_loop():
    batch = size_motor(BORES, number(0.1))
    for i, bore in enumerate(BORES):
        one = size_motor(bore, number(0.1))
        assert float(batch.mass[i]) == pytest.approx(float(one.mass), rel=1e-13)
        assert float(batch.circuit.at(torch.tensor(i)).inductance_q) == pytest.approx(
            float(one.circuit.inductance_q), rel=1e-11
        )


@pytest.mark.parametrize(("bore", "length"), [(0.0, 0.1), (0.2, -0.1)])
def test_a_machine_without_size_is_refused(bore, length):
    with pytest.raises(ValueError, match="both must be positive"):
        size_motor(number(bore), number(length))


@pytest.mark.parametrize("bore", [1e-3, 5e-3, 8e-3])
def test_a_bore_that_cannot_hold_its_magnets_is_refused(bore):
    with pytest.raises(ValueError, match=f"motor diameter = {bore:g} m is invalid"):
        size_motor(number(bore), number(0.1))


def test_the_smallest_motor_that_a_vehicle_file_may_name_has_positive_parts():
    motor = size_motor(number(0.05), number(0.01))
    values = [motor.mass, *(getattr(motor.circuit, field.name) for field in fields(motor.circuit))]
    assert all(float(value) > 0.0 for value in values)

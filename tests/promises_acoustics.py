"""Promises of noise, motors and batteries: see `test_library_contract`."""

from dataclasses import replace

import torch
from promise import Promise

from lpc_mdo.disciplines import absorption, motor, motor_limits, sound
from lpc_mdo.disciplines.airfoil_self_noise import (
    Listener,
    Section,
    laminar_vortex_noise,
    tip_vortex_noise,
    trailing_edge_noise,
)
from lpc_mdo.disciplines.battery import energy_state_of_charge
from lpc_mdo.disciplines.broadband_noise import gill_lee, schlegel_king_mull
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, lg_m50_voltage, pack_discharge, thevenin_discharge
from lpc_mdo.disciplines.hover_noise import hover_noise, observer_position, third_octave_spectrum
from lpc_mdo.disciplines.motor_sizing import size_motor
from lpc_mdo.disciplines.noise_map import HoverSource, heard_levels
from lpc_mdo.disciplines.rotor_self_noise import rotor_self_noise
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import LoadingHarmonics, loading_harmonics_noise, lowson_noise
from lpc_mdo.numerics.bessel import bessel_j, bessel_table
from lpc_mdo.numerics.trinomial import trinomial_root

STATIONS = 6


def a_loading(load, chord, speed, radius):
    """Four tensors (...,) make a rotor (..., station)."""
    share = torch.linspace(0.25, 0.95, STATIONS, dtype=load.dtype)
    r = radius[..., None] * share
    one = torch.ones_like(load)
    return BladeLoading(
        radius=r,
        width=(r[..., 1] - r[..., 0])[..., None],
        thrust_per_length=2500.0 * load[..., None] * share**2,
        torque_per_length=400.0 * load[..., None] * share**2,
        chord=chord[..., None] * torch.ones_like(r),
        thickness_to_chord=0.12,
        pitch_angle=torch.full_like(r, 0.1),
        blades=2.0 * one,
        rotation_speed=speed,
        density=1.2 * one,
        speed_of_sound=340.0 * one,
    )


def tones(model):
    def levels(load, chord, speed, radius, height):
        noise = model(a_loading(load, chord, speed, radius), height, torch.full_like(height, 76.2), 3)
        return sound.sound_pressure_level(noise.pressure_squared)

    return levels


def known_phases(load, chord, speed, radius, height):
    loading = a_loading(load, chord, speed, radius)
    shares = torch.tensor([1.0, 0.2, 0.1, 0.05], dtype=load.dtype)[:, None]
    unsteady = LoadingHarmonics(
        torch.complex(shares * loading.thrust_per_length[..., None, :], 0.0 * shares * loading.radius[..., None, :]),
        torch.complex(shares * loading.torque_per_length[..., None, :], 0.0 * shares * loading.radius[..., None, :]),
    )
    distance, azimuth = torch.full_like(height, 76.2), torch.full_like(height, 0.3)
    return sound.sound_pressure_level(loading_harmonics_noise(loading, unsteady, height, distance, azimuth, 3))


def a_hover(load, chord, speed, radius):
    """What `hover_noise` takes of two rotors, up to the observer."""
    each = [torch.stack([v, 1.05 * v], dim=-1) for v in (load, chord, speed, radius)]
    hubs = torch.stack([torch.zeros(2, 3), torch.tensor([[0.0, 4.0, 0.0]] * 2)])[:, 0].to(load)
    angle = 0.1 * torch.ones(2, STATIONS).to(load)
    return HoverSource(a_loading(*each), 4000.0 * each[0], each[3], angle, hubs)


def spectrum(load, chord, speed, radius, height):
    observer = torch.stack([0.3 * height, torch.zeros_like(height), height], dim=-1)
    noise = hover_noise(*vars(a_hover(load, chord, speed, radius)).values(), observer, broadband_model="gill_lee")
    return third_octave_spectrum(noise, sound.third_octave_centers(100.0, 2e3).to(load))


def heard_on_the_ground(load, chord, speed, radius, height):
    """At two places, brought behind the batch; `height` shifts what the blades carry, so that it enters."""
    places = torch.tensor([[40.0, 10.0, -76.0], [-20.0, 30.0, -76.0]]).to(load)
    source = a_hover(load * (1.0 + 1e-3 * height), chord, speed, radius)
    wide = replace(source, hubs=source.hubs.expand(*load.shape, 2, 3))
    return heard_levels(wide, places).movedim(0, -1)


def two_rotors(load, chord, speed, radius, height):
    observer = torch.stack([0.3 * height, torch.zeros_like(height), height], dim=-1)
    return hover_noise(*vars(a_hover(load, chord, speed, radius)).values(), observer).total_dba


def strip_levels(speed, chord, alpha, distance, cosine):
    one = torch.ones_like(speed)
    strip = Section(speed, chord, 0.5 * one, alpha, 340.0 * one, 1.46e-5 * one)
    listener = Listener(distance, cosine, 0.8 * one)
    bands = torch.tensor([400.0, 1000.0, 2500.0]).to(speed)
    edge = trailing_edge_noise(strip, listener, bands, "untripped")
    parts = (edge.total, laminar_vortex_noise(strip, listener, bands), tip_vortex_noise(strip, listener, bands))
    return sound.sound_pressure_level(torch.cat(parts, dim=-1))


def self_noise(load, chord, speed, radius, height):
    loading = a_loading(load, chord, speed, radius)
    arm = torch.stack([0.5 * height, torch.zeros_like(height), height], dim=-1)
    alpha = 0.03 * load[..., None] * torch.ones(STATIONS).to(load)
    return sound.sound_pressure_level(rotor_self_noise(loading, alpha, arm, azimuths=4).bands[..., 10:25])


def a_circuit(flux, saliency, resistance):
    one = torch.ones_like(flux)
    return motor.MotorCircuit(
        pole_pairs=6.0 * one, phase_resistance=resistance, inductance_d=2e-4 * one, inductance_q=2e-4 + saliency,
        flux_linkage=flux, voltage_limit=460.0 * one, current_limit=400.0 * one, hysteresis=0.3 * one, eddy=2e-3 * one,
        bearing_torque=0.2 * one, windage=2e-7 * one, stray_share=0.007 * one,
    )  # fmt: skip


def operated(flux, saliency, resistance, torque, speed):
    o = motor.operate_motor(a_circuit(flux, saliency, resistance), torque, speed)
    return torch.stack([o.current_d, o.current_q, o.voltage, o.input_power / 1e3], dim=-1)


def sized(bore, length):
    machine = size_motor(bore, length)
    c = machine.circuit
    return torch.stack([machine.mass, machine.flux_density, 1e3 * c.phase_resistance, c.current_limit], dim=-1)


ROTOR = ([1.0, 0.8, 1.2], [0.2, 0.15, 0.3], [115.0, 90.0, 140.0], [1.5, 1.4, 1.2], [-70.0, -40.0, 30.0])
BROADBAND = (
    [4e3, 3e3, 5e3], [1.5, 1.4, 1.2], [170.0, 120.0, 200.0], [0.5, 0.4, 0.3], [1.2, 1.1, 1.0]
)  # fmt: skip
PHASE = ([0.08, 0.06, 0.1], [1.2e-4, 1e-7, 2e-4], [0.012, 0.02, 0.008])
MISSION = ([[30.0, 9.0], [20.0, 4.0], [10.0, 0.0]], [[90.0, 900.0], [60.0, 500.0], [10.0, 30.0]])

PROMISES = {
    "bessel_j": Promise(lambda x: bessel_j(torch.arange(4.0).to(x), x[..., None]), ([0.5, 7.0, 2.0],)),
    "bessel_table": Promise(lambda x: bessel_table(x, 5), ([0.5, 7.0, 2.0],)),
    "trinomial_root": Promise(lambda c: trinomial_root(c, 4), ([0.1, 3.0, 50.0],)),
    "a_weighting_factor": Promise(sound.a_weighting_factor, ([30.0, 1e3, 9e3],), 1e-3),
    "tones_in_third_octaves": Promise(
        lambda f, e: sound.tones_in_third_octaves(
            f[..., None], e[..., None], sound.third_octave_centers(100.0, 2e3).to(f)
        ),
        ([205.0, 515.0, 1020.0], [1.0, 2.0, 3.0]),
    ),
    "observer_position": Promise(
        lambda c: observer_position(c, 76.2, 1.4), ([[0.0, 1.0, 2.0], [3.0, -4.0, 5.0], [-1.0, 0.5, 2.0]],)
    ),
    "third_octave_spectrum": Promise(spectrum, ROTOR, 1e-3),
    "heard_levels": Promise(heard_on_the_ground, ROTOR),
    "efficiency_map": Promise(
        lambda f, s, r: (
            motor_limits.efficiency_map(
                a_circuit(f, s, r), torch.tensor([20.0, 60.0]).to(f), torch.tensor([100.0, 400.0, 900.0]).to(f)
            ).efficiency
        ),
        PHASE,
        1e-3,
    ),
    "a_weighting": Promise(sound.a_weighting, ([30.0, 1e3, 9e3],), 1e-3),
    "sound_pressure_level": Promise(sound.sound_pressure_level, ([1e-9, 1e-3, 2.0],)),
    "squared_pressure": Promise(sound.squared_pressure, ([20.0, 60.0, 110.0],)),
    "bands_in_third_octaves": Promise(
        lambda f, e: sound.bands_in_third_octaves(
            f[..., None], e[..., None], sound.third_octave_centers(100.0, 2e3).to(f), 3
        ),
        ([210.0, 555.0, 1030.0], [1.0, 2.0, 3.0]),
    ),
    "atmospheric_absorption": Promise(
        lambda f, t, h: 1e3 * absorption.atmospheric_absorption(f, t, torch.full_like(f, 101325.0), h),
        ([50.0, 500.0, 4e3], [280.0, 290.0, 300.0], [0.2, 0.5, 0.9]),
    ),
    "spherical_spreading": Promise(absorption.spherical_spreading, ([10.0, 76.0, 500.0],)),
    "transmitted_share": Promise(absorption.transmitted_share, ([1e-3, 0.01, 0.03], [10.0, 76.0, 500.0])),
    "barry_magliozzi": Promise(tones(barry_magliozzi), ROTOR),
    "lowson_noise": Promise(tones(lowson_noise), ROTOR),
    "loading_harmonics_noise": Promise(known_phases, ROTOR),
    "schlegel_king_mull": Promise(
        lambda t, r, v, a, rho, h: schlegel_king_mull(
            t, r, v, a, rho, torch.full_like(t, 0.7), torch.full_like(t, 76.2), h
        ).bands.log(),
        (*BROADBAND, [0.04, 0.03, 0.05]),
    ),
    "gill_lee": Promise(
        lambda t, r, v, a, rho, s: gill_lee(
            t, r, v, a, torch.full_like(t, 2.0), rho, torch.full_like(t, 340.0), s, torch.full_like(t, 76.2)
        ).bands.log(),
        (*BROADBAND, [0.99, 0.7, 0.3]),
    ),
    "hover_noise": Promise(two_rotors, ROTOR),
    "displacement_thickness, trailing_edge_noise, laminar_vortex_noise, tip_vortex_noise": Promise(
        strip_levels, ([70.0, 50.0, 120.0], [0.3, 0.2, 0.1], [0.05, 0.03, 0.11], [1.2, 2.0, 5.0], [0.1, -0.5, 0.3])
    ),
    "rotor_self_noise, blade_strips, heard_over_a_turn": Promise(self_noise, ROTOR, 1e-3),
    "maximum_torque_per_ampere": Promise(
        lambda f, s, r, t: torch.stack(motor.maximum_torque_per_ampere(a_circuit(f, s, r), t), dim=-1),
        (*PHASE, [250.0, -100.0, 400.0]),
    ),
    "electromagnetic_torque": Promise(
        lambda f, s, r, d, q: motor.electromagnetic_torque(a_circuit(f, s, r), d, q),
        (*PHASE, [-100.0, 0.0, -50.0], [200.0, 100.0, -50.0]),
    ),
    "voltage_squared": Promise(
        lambda f, s, r, d, q: motor.voltage_squared(a_circuit(f, s, r), d, q, torch.full_like(d, 300.0)),
        (*PHASE, [-100.0, 0.0, -50.0], [200.0, 100.0, -50.0]),
    ),
    # The first below the voltage limit, the others in flux weakening.
    "operate_motor": Promise(operated, (*PHASE, [250.0, -90.0, 100.0], [300.0, 1500.0, 1000.0]), 1e-3),
    "maximum_torque": Promise(
        lambda f, s, r, w: motor_limits.maximum_torque(a_circuit(f, s, r), w), (*PHASE, [300.0, 1000.0, 900.0]), 1e-3
    ),
    "friction_torque": Promise(
        lambda f, w: motor.friction_torque(a_circuit(f, f, f), w), (PHASE[0], [300.0, 0.0, 900.0])
    ),
    "size_motor": Promise(sized, ([0.2, 0.25, 0.3], [0.05, 0.08, 0.12])),
    "energy_state_of_charge": Promise(
        lambda p, t, m: energy_state_of_charge(p, t, m, 4e3).state_of_charge, (*MISSION, [50.0, 60.0, 70.0])
    ),
    "lg_m50_voltage": Promise(lg_m50_voltage, ([0.1, 0.5, 0.9],)),
    "thevenin_discharge": Promise(
        lambda p, t, s: thevenin_discharge(LG_M50, p, t, s).terminal_voltage, (*MISSION, [1.0, 0.9, 0.8])
    ),
    "pack_discharge": Promise(
        lambda p, t, m: pack_discharge(LG_M50, 1e3 * p, t, m, 4e5).state_of_charge, (*MISSION, [160.0, 170.0, 180.0])
    ),
}

"""What a trip costs: energy, battery wear, airframe and avionics over their lives, pilots, maintenance, overhead, empty flights.

Source of model and rates: the public trade study of electric on-demand aircraft of the Convex Engineering group at MIT
(convexengineering/eVTOL, models/cost_models.py and standard_substitutions.py), whose trip costs of four configurations come out
within 1.5 %. Prices are dollars of about 2018 and far less certain than any mass.
"""

from dataclasses import dataclass

from torch import Tensor

from lpc_mdo.numerics.constants import POUND

HOUR = 3600.0  # s
KILOWATT_HOUR = 3.6e6  # J


@dataclass(frozen=True)
class CostRates:
    """Dollars by SI units. Other public rates stand behind those of the source, which are the defaults."""

    airframe: float = 350.0 / POUND  # $/kg without battery and avionics; Janning (2024): 1437 euro/kg empty
    airframe_life: float = 20000.0 * HOUR  # s in service; NASA/CR-2019-220217: 12 000 to 15 000 h of flight
    avionics: float = 60000.0  # $, of an aircraft that can fly itself
    avionics_life: float = 20000.0 * HOUR
    battery: float = 400.0 / KILOWATT_HOUR  # $/J of capacity; Janning: 115 euro/kWh
    battery_life: float = 2000.0  # cycles; NASA/CR-2019-220217: 900 at half depth
    energy: float = 0.12 / KILOWATT_HOUR  # $/J from the grid; Janning: 0.0967 euro/kWh
    charging_efficiency: float = 0.9
    pilot: float = 70.0 / HOUR  # $/s with overhead
    pilots: float = 1.5  # an aircraft with passengers
    pilots_empty: float = 0.125  # an aircraft that flies empty: one on the ground for eight
    mechanic: float = 60.0 / HOUR  # $/s with overhead; NASA/CR-2019-220217: 60 to 100 $/h
    maintenance_share: float = (
        0.6  # mechanic's hours by hour in service; NASA/CR-2019-220217: 0.25 to 1 by hour of flight
    )
    indirect_share: float = 0.12  # of energy, pilots and maintenance
    empty_share: float = 0.2  # of all flights


@dataclass(frozen=True)
class TripCost:
    """Dollars, each (...,), of one trip with passengers, and the share of empty flights that it must pay for."""

    energy: Tensor
    battery: Tensor
    airframe: Tensor
    avionics: Tensor
    pilots: Tensor
    maintenance: Tensor
    indirect: Tensor
    empty_flights: Tensor

    @property
    def total(self) -> Tensor:
        total: Tensor = sum(vars(self).values())
        return total


@dataclass(frozen=True)
class PurchasePrice:
    """Dollars, each (...,)."""

    airframe: Tensor
    avionics: Tensor
    battery: Tensor

    @property
    def total(self) -> Tensor:
        return self.airframe + self.avionics + self.battery


def purchase_price(airframe_mass: Tensor, battery_energy: Tensor, rates: CostRates | None = None) -> PurchasePrice:
    """Price (...,) of an aircraft from its mass (...,) kg, empty without battery, and its battery's capacity (...,) J."""
    rates = rates or CostRates()
    airframe = rates.airframe * airframe_mass
    return PurchasePrice(airframe, 0.0 * airframe + rates.avionics, rates.battery * battery_energy)


def trip_cost(
    price: PurchasePrice,
    energy: Tensor,
    time: Tensor,
    rates: CostRates | None = None,
    battery_cycles: float | Tensor = 1.0,
) -> TripCost:
    """Cost (...,) of one trip.

    energy (...,) J drawn from the battery; time (...,) s in service, on the ground for passengers and charging included;
    battery_cycles (...,): what a trip takes of the battery's life, one each in the source. Empty flights are as long as others and draw
    as much.
    """
    rates = rates or CostRates()
    by_energy = rates.energy / rates.charging_efficiency * energy
    wear = price.battery * battery_cycles / rates.battery_life
    airframe, avionics = price.airframe * time / rates.airframe_life, price.avionics * time / rates.avionics_life
    maintenance = rates.mechanic * rates.maintenance_share * time
    pilots, pilots_empty = rates.pilot * rates.pilots * time, rates.pilot * rates.pilots_empty * time
    indirect = rates.indirect_share * (by_energy + maintenance + pilots)
    capital = wear + airframe + avionics
    empty = capital + (1.0 + rates.indirect_share) * (by_energy + maintenance + pilots_empty)
    empty_flights = rates.empty_share / (1.0 - rates.empty_share)  # by flight with passengers
    return TripCost(by_energy, wear, airframe, avionics, pilots, maintenance, indirect, empty_flights * empty)


def cost_per_distance(cost: TripCost, passengers: float | Tensor, distance: Tensor) -> Tensor:
    """Dollars (...,) a passenger pays by metre, of a trip over distance (...,) m."""
    return cost.total / (passengers * distance)

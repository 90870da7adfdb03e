"""Solvers: motion through time and missions, equilibria, small motions, cycles; and what sensors read of them."""

from .account import forces
from .critical import CriticalValue, critical
from .cycle_means import CycleMeans, CyclePath, cycle_means, mean_data, means_of, prepare_means
from .equilibrium import Equilibrium, equilibrium
from .floating import Floating, floating, righting_curve
from .flow_numbers import flow_rows, loads_of_water, out_of_range
from .integrate import fixed_step
from .mission import Flown, Passed, mission_data, run_mission
from .modes import NaturalModes, modes
from .motor_results import overloaded, tracking_warnings
from .periodic import Periodic, Screw, periodic, screw_of
from .plant_batch import PlantBatch
from .readings import common_readings, reading, reading_of
from .results import Results, Run, Trajectory, attributes_of, drive_limits, prepare_results, results_of
from .sampled_plant import SampledPlant
from .simulate import SimulationRun, simulate
from .static import Static, load_stepping, static
from .steady import Regime, Steady, regime_of, steady
from .strain_orders import OrderError, strain_order_errors
from .stream import goes_along, in_still_water, in_stream, water_velocity, with_stream
from .symmetry import Symmetry, find_symmetry
from .turns import free_hinges, with_crank

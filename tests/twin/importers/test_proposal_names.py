"""What the names of columns say, as recorders of many countries write them."""

import pytest

from twin.importers.proposal.lexicon import Quantity, SignalRole
from twin.importers.proposal.names import names_of, words_of

SHORT = {
    "p": Quantity.POSITION, "v": Quantity.VELOCITY, "a": Quantity.ACCELERATION,
    "f": Quantity.FORCE, "i": Quantity.CURRENT, "d": Quantity.DRIVE, "-": Quantity.OTHER,
    "?": None, "m": SignalRole.MEASURED, "r": SignalRole.ASKED, "c": SignalRole.PART,
}  # fmt: skip

# quantity, and role where there is one; unit; axis; name
NAMES = """
p  .   .       accel is none of these: Winkel_
pm .   .       act
pr .   .       request
p  deg .       Winkel [°]
pm counts .    Istposition [inc]
pr counts .    Sollposition [inc]
im mA  .       Iststrom [mA]
i  .   .       Motorstrom
fr .   x       Momentensollwert X
vm .   x       Drehzahlistwert X
-  .   x       Schleppabstand X
pm .   x       x_act
pr .   y       y_set
f  .   x       Fx
vr .   .       qd_ref
pr .   0       state.q_d[0]
fr .   0       state.tau_J_d[0]
fc .   .       tau_ff
fc .   0       state.tau_ext_hat_filtered[0]
i  A   .       servo_stats.q_A
-  .   .       servo_stats.d_A
-  .   .       D Current
im .   0       axis0.motor.current_control.Iq_measured
pm .   .       current_position
a  .   x       accel_x
pm mm  .       实际位置(mm)
pr mm  .       指令位置(mm)
im A   .       实际电流(A)
f  Nm  .       转矩(N·m)
pm mm  .       現在位置[mm]
f  %   .       トルク[%]
pm mm  .       Position mesurée (mm)
pr mm  .       Consigne (mm)
f  N   .       Effort (N)
v  rpm .       Vitesse [tr/min]
v  mm/s .      vel_mm_s
v  deg/s .     speed_dps
pm mm  .       Фактическое положение, мм
pr mm  .       Заданное положение [мм]
vm mm/s .      Скорость (факт), мм/с
v  rpm .       Скорость двигателя, об/мин
f  Nm  x       Момент X, Н·м
im A   .       Ток двигателя (измеренное) [А]
-  .   .       Ошибка положения, мм
p  deg y       Угол Y (град)
f  Nm  .       torque_nm
f  %   .       torque_pct
f  %   .       torque [% Mn]
f  1   .       Drehmoment [0/00 Mn]
f  1   .       torque [per mille]
f  1   .       torque (0.1 % rated)
p  nm  .       position_nm
i  A   .       torque [A]
p  rad .       velocity [rad]
pm .   0       FPOS(0)
pr .   0       RPOS(0)
fm .   .       0x6077
pm .   .       S-0-0051
fm .   0       r80[0]
d  .   0       pid.0.output
?  .   .       Í
d  %   x       TCMD(X)[%]
f  lb-in .     Torque [lb-in]
f  kgf·cm .    Torque (kgf·cm)
p  arcsec .    Angle [arcsec]
p  thou .      Position [thou]
v  0.1_rpm .   Speed [0.1 rpm]
p  1e-6_m .    Position [1e-6 m]
p  .   left    Position [left]
pm .   .       Position [actual]
?  .   .       vir
"""


@pytest.mark.parametrize("line", NAMES.strip().splitlines()[1:])
def test_a_name_says_quantity_role_unit_and_axis(line):
    said, unit, axis, name = line.split(maxsplit=3)
    found = names_of([name])[name]
    assert found.quantity is SHORT[said[0]]
    if found.quantity is not Quantity.OTHER:
        assert found.role is (SHORT[said[1]] if said[1:] else None)
        assert found.unit == (None if unit == "." else unit.replace("_", " "))
        assert found.axis[-1:] == (() if axis == "." else (axis,))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("NcToPlc.ActPos", ["nc", "to", "plc", "act", "pos"]),
        ("poscmd", ["pos", "cmd"]),
        ("Momentensollwert", ["momenten", "sollwert"]),
        ("Schlittenposition", ["schlitten", "position"]),
        ("Positionsistwert", ["positions", "istwert"]),
        ("电机实际电流", ["电机", "实际", "电流"]),
        ("Führungsgröße", ["fuhrungsgrosse"]),
        ("elbow", ["elbow"]),
    ],
)
def test_words_that_are_written_as_one_are_taken_apart(name, words):
    assert words_of(name) == words


def test_a_beginning_that_all_names_share_says_nothing():
    names = names_of(["actual_q_0", "actual_qd_0", "actual_current_0"])
    assert [n.role for n in names.values()] == [None, None, None]


@pytest.mark.parametrize(
    ("columns", "units"),
    [
        (("position_m", "setpoint_m", "force_N"), ("m", "m", "N")),
        (("pos_m", "ref_m", "current_a"), ("m", "m", "A")),
        (("pos_m", "ref_l", "force"), ("m", None, None)),  # l of the load
    ],
)
def test_a_letter_behind_is_a_unit_where_two_of_a_file_are(columns, units):
    names = names_of(columns)
    assert tuple(names[c].unit for c in columns) == units
    assert names[columns[1]].quantity is Quantity.POSITION


@pytest.mark.parametrize("shared", ["DeviceId 4/", "Model Error Handler/", "TemperatureTest/"])
def test_what_all_names_have_in_common_refuses_none(shared):
    names = names_of([f"{shared}{n}" for n in ("x_meas [m]", "x_ref [m]", "F_cmd [N]")])
    told = [(n.quantity, n.role) for n in names.values()]
    asked = SignalRole.ASKED
    assert told == [
        (Quantity.POSITION, SignalRole.MEASURED), (Quantity.POSITION, asked),
        (Quantity.FORCE, asked),
    ]  # fmt: skip

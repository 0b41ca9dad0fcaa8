"""Words by which recorders name their columns, in English, German, French, Chinese and Japanese.

Plain data: words are in lower case and without accents, separated by blanks.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from functools import cache


class Quantity(Enum):
    """What a column holds."""

    POSITION = auto()
    VELOCITY = auto()
    ACCELERATION = auto()
    FORCE = auto()
    CURRENT = auto()
    DRIVE = auto()  # what may stand for a force: a voltage, a duty cycle, the output of a loop
    PRESSURE = auto()
    TEMPERATURE = auto()
    OTHER = auto()  # no signal of an axis: an error, a limit, a time


CHANNELS = (Quantity.PRESSURE, Quantity.TEMPERATURE)  # beside the motion and its force


class SignalRole(Enum):
    """Whether a column was measured, asked for, or is only a part of a command."""

    MEASURED = auto()
    ASKED = auto()
    PART = auto()


QUANTITIES: Mapping[Quantity, str] = {
    Quantity.POSITION: """
        position positions pos displacement disp distance travel stroke angle angles ang theta
        rotation extension elongation coordinate deflection crosshead qpos jpos
        winkel weg lage stellung hub auslenkung traverse deplacement course
        posicion posizione angulo angolo desplazamiento spostamento recorrido corsa carrera
        位置 位移 角度 转角 行程 変位 变位 ポジション ストローク 回転角 座標 坐标""",
    Quantity.VELOCITY: """
        velocity velocities vel velo speed speeds spd rpm erpm qd dq qdot qvel omega vitesse
        geschwindigkeit geschw drehzahl velocidad velocita 速度 转速 回転数 回転速度 角速度""",
    Quantity.ACCELERATION: """
        acceleration accelerations accel acc qdd ddq qddot beschleunigung beschl 加速度 角加速度""",
    Quantity.FORCE: """
        force forces torque torques trq tq tau effort efforts thrust moment kraft drehmoment
        fuerza forza coppia momento esfuerzo sforzo spinta empuje
        momenten couple poussee frc 力 力矩 转矩 扭矩 推力 トルク 荷重""",
    Quantity.CURRENT: """
        current currents curr cur crnt amps ampere iq isq strom courant intensite
        corriente corrente 电流 電流""",
    Quantity.DRIVE: """
        pwm duty voltage volt volts spannung tension ctrl 电压 電圧""",
    Quantity.PRESSURE: "pressure pressures press druck pression presion pressione 压力 圧力",
    Quantity.TEMPERATURE: """
        temperature temperatures temperatur temperaturen temperatura temp 温度""",
    Quantity.OTHER: """
        error err ferr ferror deviation difference diff lag following schleppfehler schleppabstand
        fehler regeldifferenz abweichung erreur ecart droop 误差 偏差 誤差 jerk ruck
        power leistung puissance 功率 電力 energy
        limit limits max min maximum minimum supply bus vbus battery humidity
        barometric barometer mode fault faults enable enabled activated trigger flag flags alarm
        word bit bits code checksum crc id index count counter frame seq line row sample gain
        covariance frequency phase tool payload friction gravity coriolis noise
        time times timestamp stamp temps zeit tiempo tempo clock date datum uhrzeit 时间 時間""",
}

# Words that tell a quantity where none of those above does.
HINTS: Mapping[Quantity, str] = {
    Quantity.POSITION: """encoder enc codeur drehgeber geber tacho tachometer resolver lvdt
        q x y z s alpha beta phi""",
    Quantity.VELOCITY: "v w n",
    Quantity.ACCELERATION: "a",
    Quantity.FORCE: "load loadcell kraftmessdose f m 负载 負荷",
    Quantity.CURRENT: "i",
    Quantity.DRIVE: "u output out control vm mv",
}

ROLES: Mapping[SignalRole, str] = {
    SignalRole.ASKED: """
        setpoint setpoints set sp reference references ref target targets tgt desired des
        demand demanded dmd command commands commanded cmd cmptd computed goal goals
        requested request req nominal nom wanted planned plan trajectory traj profile
        programmed prog input action control soll sollwert vorgabe fuhrungsgrosse
        consigne cons commande cible consigna comandada comandata comandato mando referencia
        riferimento objetivo obiettivo deseada desiderata
        指令 目标 目標 设定 設定 给定 期望 命令""",
    SignalRole.MEASURED: """
        actual act measured meas measure mes mesure mesuree feedback fb fbk fdb fdbk present pv
        real reel reelle readback reading sensor est estimate estimated observation obs monitor ist
        istwert gemessen mess messwert
        medida medido misurata misurato attuale reale effettiva lectura lettura
        实际 实测 反馈 当前 現在 実際 実測 実 フィードバック 測定""",
    SignalRole.PART: """
        ff feedforward fwd ffw pid vorsteuerung comp compensation integral integrator additive
        offset ext external extern disturbance residual 前馈 前饋 外力""",
}


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


@cache
def words_of_the_far_east() -> frozenset[str]:
    """Those of several signs that are not Latin."""
    words = " ".join((*QUANTITIES.values(), *ROLES.values()))
    return frozenset(w for w in words.split() if len(w) > 1 and ord(w[0]) > 0x2E7F)


SMOOTHED = _set("filtered filt smoothed sm avg averaged lowpass lp gefiltert")

# Words that tell neither a signal nor an axis.
EMPTY = _set(
    """axis axes achse achsen axe joint joints gelenk motor motors mot moteur drive drives antrieb
    servo servos nc plc to main gvl prg data value values val wert signal channel ch msg header
    field interface interfaces controller node device dev root model robot arm in of the de la du
    state states stats status link actuator unit raw log shaft from is plant rms lr internal
    machine maschine stage slide table tisch schlitten last abtrieb cycle total sum net point
    process angulaire 电机 电动机 関節 关节 軸 轴 モータ モーター"""
)

# Words of a name that make an axis rotary where no unit says what it is.
TURNING = _set(
    """torque torques trq tq tau moment drehmoment momenten couple angle angles theta winkel joint
    effort rpm erpm drehzahl q qd dq qdot qpos qvel rotation shoulder elbow wrist hip knee ankle
    waist gripper pan tilt roll pitch yaw 转矩 扭矩 力矩 トルク 角度 转速 回転数"""
)

# A quantity before the word is its rate.
RATES: Mapping[str, Mapping[Quantity, Quantity]] = {
    "dot": {
        Quantity.POSITION: Quantity.VELOCITY,
        Quantity.VELOCITY: Quantity.ACCELERATION,
    },
    "ddot": {Quantity.POSITION: Quantity.ACCELERATION},
}

# Numbers of rows by these words; of an encoder they are its unit.
COUNTING = _set("index count counter frame seq line row sample")

# What drives call by number or in code, and the words that it stands for.
CODES: Mapping[str, str] = {
    # SINAMICS
    r"\br0*6[13]\b": "velocity actual",
    r"\br0*62\b": "velocity setpoint",
    r"\br0*(80|31)\b": "torque actual",
    r"\br0*79\b": "torque setpoint",
    r"\br0*(78|68|27)\b": "current actual",
    r"\br0*77\b": "current setpoint",
    r"\br0*482\b": "position actual",
    # objects of CiA 402
    r"(?i)\b(0x)?6064h?\b": "position actual",
    r"(?i)\b(0x)?(6062|607a)h?\b": "position setpoint",
    r"(?i)\b(0x)?606ch?\b": "velocity actual",
    r"(?i)\b(0x)?(60ff|606b)h?\b": "velocity setpoint",
    r"(?i)\b(0x)?6077h?\b": "torque actual",
    r"(?i)\b(0x)?607[14]h?\b": "torque setpoint",
    r"(?i)\b(0x)?6078h?\b": "current actual",
    r"(?i)\b(0x)?60f4h?\b": "position error",
    # SERCOS
    r"(?i)\bS-0-005[13]\b": "position actual",
    r"(?i)\bS-0-0047\b": "position setpoint",
    r"(?i)\bS-0-0040\b": "velocity actual",
    r"(?i)\bS-0-0036\b": "velocity setpoint",
    r"(?i)\bS-0-0084\b": "torque actual",
    r"(?i)\bS-0-0080\b": "torque setpoint",
    r"(?i)\bS-0-0189\b": "position error",
    # ACS, Kollmorgen, Galil, Elmo
    r"(?i)\b(FPOS|PL\.FB|_TP)(?![a-z]{2})": "position actual",
    r"(?i)\b(RPOS|APOS|PL\.CMD|_RP)(?![a-z]{2})": "position setpoint",
    r"(?i)\b(FVEL|VL\.FB|_TV)(?![a-z]{2})": "velocity actual",
    r"(?i)\b(RVEL|VL\.CMD)(?![a-z]{2})": "velocity setpoint",
    r"(?i)\bIL\.FB(?![a-z]{2})": "current actual",
    r"(?i)\bIL\.CMD(?![a-z]{2})": "current setpoint",
    r"(?i)\b(DCOM|_TT)(?![a-z]{2})": "torque",
    r"(?i)\b(PE|_TE)(?![a-z]{2})": "position error",
}

# In which unit such columns are recorded where their names state none: it is assumed.
CUSTOMARY: Mapping[str, str] = {
    r"\bpos_(estimate|setpoint)\b|\binput_pos\b": "rev",  # ODrive, from 0.5 on
    r"\bvel_(estimate|setpoint)\b|\binput_vel\b": "rev/s",
    r"\bservo_stats\.(control_)?position\b": "rev",  # moteus
    r"\bservo_stats\.(control_)?velocity\b": "rev/s",
    r"\bjoint\.\d+\.(motor-)?pos-": "mm",  # LinuxCNC
    r"\b(observation\.state|action)\b.*\.pos\b": "deg",  # LeRobot
    r"(?i)\brpm\b": "rpm",
    r"(?i)\b_TT": "V",  # Galil
    r"(?i)\bDCOM": "%",  # ACS
}

RAW = frozenset(("counts", "%", "V", "mV", "1"))  # what only a scale turns into a quantity

# Canonical unit (of the import map) -> its other spellings.
UNITS: Mapping[Quantity, Mapping[str, str]] = {
    Quantity.POSITION: {
        "m": "meter meters metre metres",
        "mm": "millimeter millimeters millimetre millimetres 毫米",
        "um": "µm μm micron microns micrometer",
        "nm": "nanometer",
        "cm": "centimeter",
        "in": "inch inches zoll",
        "rad": "radian radians radiant",
        "mrad": "",
        "urad": "µrad μrad",
        "deg": "degree degrees grad ° º 度",
        "rev": "revs revolution revolutions turn turns rotation rotations umdrehung umdrehungen",
        "arcsec": "",
        "counts": """count cnt cnts cts ct inc incs inkr ink inkremente increment increments pulse
            pulses pls ticks tick lsb digit digits steps impulse counts16bit 脉冲 パルス""",
    },
    Quantity.VELOCITY: {
        "rpm": "r/min u/min 1/min min-1 min^-1 min⁻¹ tr/min umin",
        "deg/s": "dps",
        "rev/s": "rps tps",
        "in/s": "ips",
    },
    Quantity.ACCELERATION: {"g": ""},
    Quantity.FORCE: {
        "N": "newton newtons 牛",
        "kN": "",
        "mN": "",
        "Nm": "n.m n*m n·m n-m newtonmeter newtonmeters",
        "mNm": "mn.m mn*m mn·m",
        "Ncm": "n.cm",
        "daN": "",
        "kgf": "",
        "lbf": "",
    },
    Quantity.CURRENT: {"A": "arms aeff apk amp amps ampere a_rms", "mA": "marms", "uA": "µa μa"},
    Quantity.DRIVE: {"V": "volt volts", "mV": "", "%": "percent pct prozent"},
    Quantity.PRESSURE: {
        "bar": "",
        "mbar": "",
        "Pa": "",
        "hPa": "",
        "kPa": "",
        "MPa": "",
        "psi": "psig psia",
    },
    Quantity.TEMPERATURE: {"degC": "°c ℃ c degc celsius", "K": "kelvin"},
    Quantity.OTHER: {
        "s": "sec secs second seconds sekunden 秒",
        "ms": "msec milliseconds millis",
        "us": "µs μs usec micros microseconds",
        "ns": "",
        "W": "watt",
        "kW": "",
        "Hz": "khz mhz",
    },
}

/// What can be broken on command, one fault at a time. Beyond the faults, the sensor behaves as ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The sensor does not acknowledge its address: a loose wire, or no supply of the bus side.
    NackAddress,
    /// The sensor acknowledges its address, and not one byte that is written to it.
    NackData,
    /// The controller reports a misplaced START or STOP.
    BusError,
    /// The controller reports that another one drove the bus.
    ArbitrationLoss,
    /// SCL is held low until the controller gives up after [`HANG_TIMEOUT`](crate::HANG_TIMEOUT), at whatever address
    /// on the sensor's bus.
    Hang,
    /// SDA is stuck high behind the acknowledge: every byte reads 0xFF.
    StuckHigh,
    /// Every byte reads 0x00.
    AllZero,
    /// The sensor measures no more; its registers read as before. An initial reset still empties them.
    Freeze,
    /// The supply fails for a moment: the sensor starts anew with its defaults. Happens once, and does not stay.
    BrownOut,
    /// The adapter is gone, for whatever address on the sensor's bus, and the sensor is without power. Clearing the
    /// fault powers it on. Another sensor on the bus keeps its power.
    Unplugged,
}

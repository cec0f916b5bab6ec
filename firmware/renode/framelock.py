# Commands for Renode's monitor, loaded by framelock.resc. Renode contains IronPython 2.7.
from System.IO import File, FileAccess, FileMode, FileStream
from System.Text import Encoding
from Antmicro.Renode.Time import TimeInterval

names = []
log_path = None

def bus():
    return monitor.Machine.SystemBus

def after(microseconds, act):
    monitor.Machine.ScheduleAction(TimeInterval.FromMicroseconds(microseconds), act)

def mc_erase_uicr():
    for word in range(0x10001200, 0x10001210, 4):
        bus().WriteDoubleWord(word, 0xFFFFFFFF)

def mc_counter_names(elf):
    """Reads the counters' names from the ELF's section .counters, which is not in flash."""
    global names
    text = Encoding.ASCII.GetString(File.ReadAllBytes(elf))
    end = start = text.index("bytes frames ")
    while text[end] in "abcdefghijklmnopqrstuvwxyz_ ":
        end += 1
    names = text[start:end].split()

def mc_counters():
    """Shows bytes, frames, and the other counters that are not 0."""
    at = bus().GetSymbolAddress("COUNTERS")
    values = [(name, bus().ReadDoubleWord(at + 4 * n)) for n, name in enumerate(names)]
    print(" ".join(["%s %d" % pair for pair in values if pair[1] or pair[0] in ("bytes", "frames")]))

def mc_setpoint():
    word = bus().ReadDoubleWord(bus().GetSymbolAddress("SETPOINT"))
    print("pitch %d roll %d yaw %d" % (word & 255, word >> 8 & 255, word >> 16 & 255))

def transmit(data, baud, done):
    """Sends bytes to UARTE0, back to back at the line's rate, in emulated time."""
    uart = monitor.Machine["sysbus.uart0"]
    def end_of(number):
        return number * 10000000 // baud
    def send(number):
        uart.WriteChar(data[number])
        number += 1
        if number < len(data):
            after(end_of(number + 1) - end_of(number), lambda _: send(number))
        else:
            done()
    after(end_of(1), lambda _: send(0))

def mc_play(path, baud=115200):
    """Sends a file's bytes."""
    transmit(File.ReadAllBytes(path), int(baud), lambda: None)

def mc_send(pitch, roll, yaw, seconds=1, baud=115200):
    """Sends a frame of BIN 100 times a second."""
    frame = [0x41, 0x42, 0, int(pitch), int(roll), int(yaw), 0x0D]
    left = [int(seconds) * 100]
    def send(_=None):
        if left[0]:
            left[0] -= 1
            transmit(frame, int(baud), lambda: after(10000 - 70000000 // int(baud), send))
    send()

def line_error(causes):
    monitor.Machine["sysbus.errorsrc"].ControlWrite(0, causes)
    bus().WriteDoubleWord(0x40002124, 1) # EVENTS_ERROR

def mc_line_error(causes):
    """Raises these causes: 1 overrun, 2 parity, 4 framing, 8 break. The byte at fault is not received."""
    line_error(int(causes))

def mc_rtt(path=None):
    """Appends the firmware's log (defmt over RTT) to a file, every 10 ms of emulated time."""
    global log_path
    log_path = path or log_path
    block = bus().GetSymbolAddress("_SEGGER_RTT")
    def poll(_):
        # Before the start-up code has run, there is no control block.
        if bus().ReadDoubleWord(block) == 0x47474553: # "SEGG"
            start, size, written, read = [bus().ReadDoubleWord(block + at) for at in (28, 32, 36, 40)]
            stream = FileStream(log_path, FileMode.Append, FileAccess.Write)
            while read != written:
                stream.WriteByte(bus().ReadByte(start + read))
                read = (read + 1) % size
            stream.Close()
            bus().WriteDoubleWord(block + 40, read)
        after(10000, poll)
    if log_path:
        after(10000, poll)

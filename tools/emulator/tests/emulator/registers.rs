//! A board whose firmware only sleeps, so that a test can use the registers itself.

use nrf52840_emulator::{Board, Image, RAM_START, Symbol};

pub(crate) const UARTE: u32 = 0x4000_2000;
pub(crate) const STARTRX: u32 = UARTE;
pub(crate) const STOPRX: u32 = UARTE + 0x004;
pub(crate) const FLUSHRX: u32 = UARTE + 0x02C;
pub(crate) const RXDRDY: u32 = UARTE + 0x108;
pub(crate) const ENDRX: u32 = UARTE + 0x110;
pub(crate) const ERROR: u32 = UARTE + 0x124;
pub(crate) const RXTO: u32 = UARTE + 0x144;
pub(crate) const RXSTARTED: u32 = UARTE + 0x14C;
pub(crate) const UARTE_SHORTS: u32 = UARTE + 0x200;
pub(crate) const ERRORSRC: u32 = UARTE + 0x480;
pub(crate) const UARTE_ENABLE: u32 = UARTE + 0x500;
pub(crate) const PSEL_RXD: u32 = UARTE + 0x514;
pub(crate) const BAUDRATE: u32 = UARTE + 0x524;
pub(crate) const RXD_PTR: u32 = UARTE + 0x534;
pub(crate) const RXD_MAXCNT: u32 = UARTE + 0x538;
pub(crate) const RXD_AMOUNT: u32 = UARTE + 0x53C;
pub(crate) const UARTE_CONFIG: u32 = UARTE + 0x56C;

pub(crate) const OVERRUN: u32 = 1;
pub(crate) const PARITY: u32 = 2;
pub(crate) const FRAMING: u32 = 4;
pub(crate) const BREAK: u32 = 8;

pub(crate) const BAUD_115200: u32 = 0x01D6_0000;
pub(crate) const BAUD_1M: u32 = 0x1000_0000;

/// Where tests receive to.
pub(crate) const BUFFER: u32 = RAM_START + 0x100;

/// Machine code: stack pointer, reset vector, sixteen and more vectors to `handler`, then code.
pub(crate) fn program(main: &[u16], handler: &[u16]) -> Vec<u8> {
    const VECTORS: u32 = 64;
    let main_at = 4 * VECTORS;
    let handler_at = main_at + 2 * u32::try_from(main.len()).unwrap();
    let mut code = Vec::new();
    code.extend((RAM_START + 0x1_0000).to_le_bytes());
    code.extend((main_at | 1).to_le_bytes());
    for _ in 2..VECTORS {
        code.extend((handler_at | 1).to_le_bytes());
    }
    for halfword in main.iter().chain(handler) {
        code.extend(halfword.to_le_bytes());
    }
    code
}

/// `wfi; b .-2`, and `bx lr` for a handler.
pub(crate) fn asleep() -> Board {
    asleep_with(Vec::new())
}

/// The same with symbols.
pub(crate) fn asleep_with(symbols: Vec<Symbol>) -> Board {
    let code = program(&[0xBF30, 0xE7FD], &[0x4770]);
    let mut board = Board::new(Image::of_code(code, symbols)).unwrap();
    board.run_for(100).unwrap();
    board
}

pub(crate) trait Registers {
    fn set(&mut self, address: u32, value: u32);
    fn get(&mut self, address: u32) -> u32;
    /// Reads an event and clears it.
    fn take_event(&mut self, address: u32) -> bool;
    fn bytes(&self, address: u32, count: usize) -> Vec<u8>;
}

impl Registers for Board {
    fn set(&mut self, address: u32, value: u32) {
        self.set_register(address, value).unwrap();
    }

    fn get(&mut self, address: u32) -> u32 {
        self.register(address).unwrap()
    }

    fn take_event(&mut self, address: u32) -> bool {
        let raised = self.get(address) == 1;
        self.set(address, 0);
        raised
    }

    fn bytes(&self, address: u32, count: usize) -> Vec<u8> {
        let mut bytes = vec![0; count];
        self.memory().read(address, &mut bytes).unwrap();
        bytes
    }
}

/// A board that receives at 1 Mbaud into [`BUFFER`].
pub(crate) fn receiving(size: u32) -> Board {
    receiving_at(BAUD_1M, 1_000_000_000, size)
}

/// The same with another rate of the receiver (register) and the sender (thousandths of a baud).
pub(crate) fn receiving_at(register: u32, millibaud: u64, size: u32) -> Board {
    let mut board = asleep();
    board.line(|line| line.set_millibaud(millibaud));
    start_receiving(&mut board, register, size);
    board
}

/// What firmware does after each reset.
pub(crate) fn start_receiving(board: &mut Board, baud: u32, size: u32) {
    board.set(PSEL_RXD, 8);
    board.set(BAUDRATE, baud);
    board.set(UARTE_ENABLE, 8);
    board.set(RXD_PTR, BUFFER);
    board.set(RXD_MAXCNT, size);
    board.set(STARTRX, 1);
}

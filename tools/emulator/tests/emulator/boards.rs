//! Creates boards whose firmware has a few instructions. While the firmware sleeps, tests can access the peripherals'
//! registers.

use nrf52840_emulator::{Board, Image, RAM_START, Symbol};

pub(crate) const UARTE: u32 = 0x4000_2000;
pub(crate) const STARTRX: u32 = UARTE;
pub(crate) const ENDRX: u32 = UARTE + 0x110;
pub(crate) const ERRORSRC: u32 = UARTE + 0x480;
pub(crate) const UARTE_ENABLE: u32 = UARTE + 0x500;
pub(crate) const PSEL_RXD: u32 = UARTE + 0x514;
pub(crate) const BAUDRATE: u32 = UARTE + 0x524;
pub(crate) const RXD_PTR: u32 = UARTE + 0x534;
pub(crate) const RXD_MAXCNT: u32 = UARTE + 0x538;

pub(crate) const BAUD_115200: u32 = 0x01D6_0000;

/// The buffer into which tests receive.
pub(crate) const BUFFER: u32 = RAM_START + 0x100;

/// Returns machine code: the stack pointer, the reset vector, all other vectors with the address of
/// `handler`, then the code.
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

/// `bx lr`
pub(crate) const RETURN: u16 = 0x4770;
/// `wfi; b .-2`
pub(crate) const SLEEP: [u16; 2] = [0xBF30, 0xE7FD];

/// Returns `movw` and `movt`, which load a constant into a register.
pub(crate) fn load(register: u16, value: u32) -> [u16; 4] {
    let half = |opcode: u16, imm: u32| {
        let imm = u16::try_from(imm & 0xFFFF).unwrap();
        let (imm4, i, imm3, imm8) = (imm >> 12, imm >> 11 & 1, imm >> 8 & 7, imm & 0xFF);
        [opcode | i << 10 | imm4, imm3 << 12 | register << 8 | imm8]
    };
    let [a, b] = half(0xF240, value);
    let [c, d] = half(0xF2C0, value >> 16);
    [a, b, c, d]
}

/// Returns code that stores a word. It leaves the address in r0 and the word in r1.
pub(crate) fn store(address: u32, value: u32) -> Vec<u16> {
    // str r1, [r0]
    [&load(0, address)[..], &load(1, value), &[0x6001]].concat()
}

/// Returns a board at power-on with this main loop, and one handler for all exceptions.
pub(crate) fn board_of(main: &[u16], handler: &[u16]) -> Board {
    board_with(main, handler, Vec::new())
}

/// Like [`board_of`], with symbols.
pub(crate) fn board_with(main: &[u16], handler: &[u16], symbols: Vec<Symbol>) -> Board {
    Board::new(Image::of_code(program(main, handler), symbols)).unwrap()
}

/// Runs the board's first instructions.
pub(crate) fn booted(mut board: Board) -> Board {
    board.run_for(100).unwrap();
    board
}

/// Returns a board whose firmware only sleeps.
pub(crate) fn asleep() -> Board {
    booted(board_of(&SLEEP, &[RETURN]))
}

pub(crate) trait Registers {
    fn set(&mut self, address: u32, value: u32);
    fn set_all(&mut self, registers: &[(u32, u32)]);
    /// Runs the board for this number of cycles.
    fn wait(&mut self, cycles: u64);
    fn get(&mut self, address: u32) -> u32;
    fn bytes(&self, address: u32, count: usize) -> Vec<u8>;
}

impl Registers for Board {
    fn set(&mut self, address: u32, value: u32) {
        self.set_register(address, value).unwrap();
    }

    fn set_all(&mut self, registers: &[(u32, u32)]) {
        for (address, value) in registers {
            self.set(*address, *value);
        }
    }

    fn wait(&mut self, cycles: u64) {
        self.run_for(cycles).unwrap();
    }

    fn get(&mut self, address: u32) -> u32 {
        self.register(address).unwrap()
    }

    fn bytes(&self, address: u32, count: usize) -> Vec<u8> {
        let mut bytes = vec![0; count];
        self.memory().read(address, &mut bytes).unwrap();
        bytes
    }
}

/// Returns a board that receives into [`BUFFER`]. `register` is the receiver's BAUDRATE, and `millibaud` the sender's
/// rate in thousandths of a baud.
pub(crate) fn receiving_at(register: u32, millibaud: u64, size: u32) -> Board {
    let mut board = asleep();
    board.line(|line| line.set_millibaud(millibaud));
    board.set_all(&[
        (PSEL_RXD, 8),
        (BAUDRATE, register),
        (UARTE_ENABLE, 8),
        (RXD_PTR, BUFFER),
        (RXD_MAXCNT, size),
        (STARTRX, 1),
    ]);
    board
}

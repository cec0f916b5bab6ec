//! How fast the emulation is: `cargo run --release -p framelock-emulator --example speed -- ELF`.
//! Floods the firmware at 1 Mbaud, and then lets it run with its main loop stuck, which never sleeps.

use std::time::Instant;

use framelock_emulator::{Board, Image, MILLISECOND};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("which ELF?")?;
    let mut board = Board::new(Image::parse(&std::fs::read(path)?)?)?;
    board.line(|line| line.set_millibaud(1_000_000_000));
    board.run_for(5 * MILLISECOND)?;
    let frames: Vec<u8> = (0..10_000_u32)
        .flat_map(|n| {
            let [a, b, c, _] = n.to_le_bytes();
            [b'A', b'B', 0, a, b, c, b'\r']
        })
        .collect();
    let (began, instructions, from) = (Instant::now(), board.instructions(), board.now());
    let end = board.send(&frames);
    board.run_until(end + MILLISECOND)?;
    tell("flooded", &board, began, instructions, from);
    let (began, instructions, from) = (Instant::now(), board.instructions(), board.now());
    board.stick_main_loop()?;
    board.run_for(100 * MILLISECOND)?;
    tell("busy", &board, began, instructions, from);
    Ok(())
}

fn tell(what: &str, board: &Board, began: Instant, instructions: u64, from: u64) {
    let seconds = began.elapsed().as_secs_f64();
    #[expect(clippy::cast_precision_loss, reason = "shown with three digits")]
    let per = |count: u64| count as f64 / seconds / 1e6;
    println!(
        "{what}: {:.1} million instructions a second, {:.1} million cycles a second",
        per(board.instructions() - instructions),
        per(board.now() - from),
    );
}

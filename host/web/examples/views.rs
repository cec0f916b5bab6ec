//! `views ADDRESS` prints the view of each position of a simulated line, as `Run::view` returns it, without cells. The
//! tests in a browser compare the page with these views.

use framelock_web::Run;

fn main() -> Result<(), String> {
    let address = std::env::args().nth(1).ok_or("give an address")?;
    let run = Run::open(&address)?;
    for position in 0..=run.positions() {
        println!("{}", run.view(position, 0, 0));
    }
    Ok(())
}

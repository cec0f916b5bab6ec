//! Finds CBMC, or unpacks Debian's packages of it into a folder of this project's own: nothing is
//! installed in the system.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use super::cbmc::Cbmc;
use crate::command::{output, run_quietly};

/// The Debian release that has the version of CBMC which Kani has under it, 6.x.
const RELEASE: &str = "trixie";
/// The checker, the solver's library, and the libraries of that release that both need.
const PACKAGES: [&str; 5] = ["cbmc", "minisat", "libc6", "libstdc++6", "libgcc-s1"];
const LOADER: &str = "ld-linux-x86-64.so.2";
const LIBRARIES: [&str; 6] = [
    LOADER,
    "libc.so.6",
    "libm.so.6",
    "libstdc++.so.6",
    "libgcc_s.so.1",
    "libminisat.so.2",
];
const KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

const BY_HAND: &str = "install CBMC 6 so that `cbmc` is in PATH \
    (https://github.com/diffblue/cbmc/releases), or Kani (`cargo install --locked kani-verifier && \
    cargo kani setup`)";

/// The checker: what `PATH` has, if it is of the right version; else what was unpacked into
/// `folder` before; else unpacked now.
pub(crate) fn cbmc(folder: &Path) -> Result<Cbmc> {
    if let Some(version) = version_of(Path::new("cbmc")) {
        if version.starts_with("6.") {
            return Ok(Cbmc {
                program: "cbmc".into(),
                says: format!("CBMC {version} (in PATH)"),
            });
        }
        eprintln!("The CBMC in PATH is {version}; the proofs need 6.x");
    }
    let program = folder.join("bin/cbmc");
    if version_of(&program).is_none() {
        eprintln!(
            "Unpacking Debian {RELEASE}'s CBMC into {}",
            folder.display()
        );
        unpack(folder).with_context(|| {
            format!("there is no CBMC here, and it could not be set up: {BY_HAND}")
        })?;
    }
    let version = version_of(&program)
        .with_context(|| format!("{} does not run: {BY_HAND}", program.display()))?;
    Ok(Cbmc {
        program,
        says: format!("CBMC {version} (Debian {RELEASE}'s)"),
    })
}

fn version_of(program: &Path) -> Option<String> {
    let answer = output(Command::new(program).arg("--version")).ok()?;
    Some(answer.split_whitespace().next()?.to_owned())
}

fn unpack(folder: &Path) -> Result<()> {
    ensure!(
        cfg!(all(target_os = "linux", target_arch = "x86_64")),
        "Debian's packages are used on x86-64 Linux only"
    );
    let lists = folder.join("lists");
    let packages = folder.join("packages");
    let unpacked = folder.join("unpacked");
    for empty in [&lists, &packages, &unpacked] {
        if empty.exists() {
            fs::remove_dir_all(empty)?;
        }
        fs::create_dir_all(empty)?;
    }
    fs::create_dir_all(lists.join("partial"))?;
    fs::create_dir_all(folder.join("bin"))?;
    fs::create_dir_all(folder.join("lib"))?;

    let sources = folder.join("sources.list");
    let signed = if Path::new(KEYRING).exists() {
        format!("[signed-by={KEYRING}] ")
    } else {
        String::new()
    };
    fs::write(
        &sources,
        format!("deb {signed}{} {RELEASE} main\n", mirror()),
    )?;
    let apt = || {
        let mut command = Command::new("apt-get");
        command.current_dir(&packages).arg("--quiet=2");
        for (option, value) in [
            ("Dir::Etc::sourcelist", sources.as_path()),
            ("Dir::Etc::sourceparts", Path::new("-")),
            ("Dir::State::Lists", &lists),
            ("Dir::Cache", &folder.join("cache")),
        ] {
            command.arg(format!("-o{option}={}", value.display()));
        }
        command.args(["-oAPT::Sandbox::User=root", "-oAcquire::Languages=none"]);
        command.arg("-oAcquire::IndexTargets::deb::DEP-11::DefaultEnabled=false");
        command
    };
    fs::create_dir_all(folder.join("cache/archives/partial"))?;
    run_quietly(apt().arg("update"))?;
    run_quietly(apt().arg("download").args(PACKAGES))?;
    for entry in fs::read_dir(&packages)? {
        let package = entry?.path();
        run_quietly(
            Command::new("dpkg-deb")
                .arg("--extract")
                .arg(package)
                .arg(&unpacked),
        )?;
    }
    for library in LIBRARIES {
        let found = find(&unpacked, library)?
            .with_context(|| format!("no package has the library {library}"))?;
        fs::copy(found, folder.join("lib").join(library))?;
    }
    let real = folder.join("bin/cbmc.real");
    fs::copy(unpacked.join("usr/bin/cbmc"), &real)?;
    write_starter(folder, &real)?;
    for done in [&lists, &packages, &unpacked, &folder.join("cache")] {
        fs::remove_dir_all(done)?;
    }
    Ok(())
}

/// The program is started through the loader of its own release, with that release's libraries.
fn write_starter(folder: &Path, real: &Path) -> Result<()> {
    use std::os::unix::fs::OpenOptionsExt as _;

    let library = fs::canonicalize(folder.join("lib"))?;
    let text = format!(
        "#!/bin/sh\nexec '{0}/{LOADER}' --library-path '{0}' '{1}' \"$@\"\n",
        library.display(),
        fs::canonicalize(real)?.display()
    );
    // Written beside and moved: a half-written one would be taken for a whole one.
    let beside = folder.join("bin/cbmc.new");
    let mut file = fs::OpenOptions::new()
        .create(true)
        .truncate(true)
        .write(true)
        .mode(0o755)
        .open(&beside)?;
    file.write_all(text.as_bytes())?;
    drop(file);
    fs::rename(beside, folder.join("bin/cbmc"))?;
    Ok(())
}

/// The mirror that this machine uses, else Debian's own.
fn mirror() -> String {
    let configured = Path::new("/etc/apt/sources.list.d");
    let files = fs::read_dir(configured).into_iter().flatten().flatten();
    let texts = files.filter_map(|entry| fs::read_to_string(entry.path()).ok());
    texts
        .flat_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>())
        .find_map(|line| {
            let mirror = line.strip_prefix("URIs:")?.split_whitespace().next()?;
            mirror
                .trim_end_matches('/')
                .ends_with("/debian")
                .then(|| mirror.to_owned())
        })
        .unwrap_or_else(|| "http://deb.debian.org/debian".to_owned())
}

/// The file of that name somewhere in the folder.
fn find(folder: &Path, name: &str) -> Result<Option<PathBuf>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() && !path.is_symlink() {
            if let Some(found) = find(&path, name)? {
                return Ok(Some(found));
            }
        } else if path.file_name().is_some_and(|file| file == name) {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

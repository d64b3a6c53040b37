//! The virtual controller against a folder that looks like sysfs, with a thread that acts as the kernel.
#![expect(unsafe_code, reason = "the kernel takes a descriptor by its number")]

use super::host::*;
use crate::usbip::{Attached, AttachedBus, Options, UsbipError, attach};
use std::fs;
use std::io::Read as _;
use std::os::fd::BorrowedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;
use tempfile::TempDir;

const HEADER: &str = "hub port sta spd dev      sockfd local_busid\n";

struct Machine(TempDir);

impl Machine {
    /// Ports as (hub, number, state).
    fn new(ports: &[(&str, u32, u32)]) -> Self {
        let machine = Self(TempDir::new().unwrap());
        let controller = "sys/devices/platform/vhci_hcd.0";
        for folder in [controller, "sys/class/i2c-dev", "dev"] {
            fs::create_dir_all(machine.path(folder)).unwrap();
        }
        let mut status = HEADER.to_owned();
        for (hub, port, state) in ports {
            status += &format!("{hub}  {port:04} {state:03} 000 00000000 000000 0-0\n");
        }
        fs::write(machine.controller("status"), status).unwrap();
        fs::write(machine.controller("attach"), "").unwrap();
        fs::write(machine.controller("detach"), "").unwrap();
        machine
    }

    fn path(&self, file: &str) -> PathBuf {
        self.0.path().join(file)
    }

    fn controller(&self, file: &str) -> PathBuf {
        self.path("sys/devices/platform/vhci_hcd.0").join(file)
    }

    fn attach(&self, options: &Options) -> Result<Attached, UsbipError> {
        attach(&rack_of(&Registers::default()), options)
    }

    fn options(&self) -> Options {
        Options {
            sysfs: self.path("sys"),
            dev: self.path("dev"),
            driver_wait: Duration::from_secs(20),
            detach_wait: Duration::from_secs(20),
        }
    }
}

fn wait_for_text(path: &Path) -> String {
    for _ in 0..2000 {
        let text = fs::read_to_string(path).unwrap();
        if !text.is_empty() {
            return text;
        }
        thread::sleep(Duration::from_millis(5));
    }
    String::new()
}

/// When the thread that acts as the kernel closes its end of the connection.
#[derive(Clone, Copy, PartialEq)]
enum LettingGo {
    WhenUnplugged,
    WhenDetached,
    Never,
}

/// The kernel's reaction to one line for `attach`: takes the socket, queries the device, makes an adapter, and removes
/// everything when the socket closes.
fn kernel(
    machine: &Machine,
    adapter: u32,
    letting_go: LettingGo,
) -> thread::JoinHandle<(String, u8)> {
    let [attach, detach, status] =
        ["attach", "detach", "status"].map(|file| machine.controller(file));
    let free = fs::read_to_string(&status).unwrap();
    let interface = machine.path("sys/bus/usb/devices/1-3/1-3:1.0");
    let node = machine.path(&format!("dev/i2c-{adapter}"));
    thread::spawn(move || {
        let line = wait_for_text(&attach);
        let number = line.split(' ').nth(1).unwrap().parse().unwrap();
        // SAFETY: the descriptor is open: the writer of its number keeps it open until the adapter exists.
        let socket = unsafe { BorrowedFd::borrow_raw(number) }.try_clone_to_owned();
        let mut client = Client(UnixStream::from(socket.unwrap()));
        let vendor = client.descriptor(0x0100, 0, 18).data[8];
        fs::create_dir_all(interface.join(format!("i2c-{adapter}"))).unwrap();
        let port = line.split(' ').next().unwrap();
        let used = format!("hs  {port:0>4} 006 002 00010001 000003 1-3\n");
        fs::write(&status, HEADER.to_owned() + &used).unwrap();
        fs::write(&node, "").unwrap();
        if letting_go == LettingGo::WhenDetached {
            wait_for_text(&detach);
            client.0.shutdown(std::net::Shutdown::Both).unwrap();
        }
        // The end of the connection unplugs the device.
        let _ = client.0.read(&mut [0; 1]);
        if letting_go == LettingGo::Never {
            return (line, vendor);
        }
        fs::remove_dir_all(interface).unwrap();
        fs::remove_file(node).unwrap();
        fs::write(&status, free).unwrap();
        (line, vendor)
    })
}

#[test]
fn a_bus_becomes_the_adapter_that_the_kernel_names_and_goes_with_its_owner() {
    let machine = Machine::new(&[("ss", 8, 4), ("hs", 0, 6), ("hs", 1, 4), ("hs", 2, 4)]);
    let kernel = kernel(&machine, 7, LettingGo::WhenUnplugged);
    let attached = machine.attach(&machine.options()).unwrap();
    let expected = AttachedBus {
        bus: 1,
        port: 1,
        adapter: 7,
        device: machine.path("dev/i2c-7"),
    };
    assert_eq!(attached.buses(), [expected]);
    attached.stop().unwrap();
    let (line, vendor) = kernel.join().unwrap();
    let words: Vec<_> = line.split(' ').collect();
    assert_eq!(words.len(), 4);
    let port_device_speed = [words[0], words[2], words[3]];
    assert_eq!(port_device_speed, ["1", "65537", "1"], "1:1, low speed");
    assert_eq!(vendor, 0x03);
    assert!(!machine.path("dev/i2c-7").exists());
}

#[test]
fn unplugging_from_the_other_side_ends_the_wait() {
    let machine = Machine::new(&[("hs", 0, 4)]);
    let kernel = kernel(&machine, 0, LettingGo::WhenDetached);
    let mut attached = machine.attach(&machine.options()).unwrap();
    fs::write(machine.controller("detach"), "0").unwrap();
    attached.wait().unwrap();
    kernel.join().unwrap();
}

#[test]
fn a_missing_part_is_named_with_its_modules() {
    let machine = Machine::new(&[("hs", 0, 4)]);
    let fails = |options: &Options| machine.attach(options).unwrap_err().to_string();
    let modules = "`modprobe -a vhci-hcd i2c-tiny-usb i2c-dev`";
    fs::remove_dir(machine.path("sys/class/i2c-dev")).unwrap();
    let error = fails(&machine.options());
    assert!(error.contains("i2c-dev is not loaded"), "{error}");
    assert!(error.contains(modules), "{error}");
    let nowhere = Options {
        sysfs: machine.path("nowhere"),
        ..machine.options()
    };
    let error = fails(&nowhere);
    for part in ["no virtual USB controller", modules, "cloud kernels"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_controller_without_a_free_port_says_how_to_free_one() {
    let machine = Machine::new(&[("hs", 0, 6), ("hs", 1, 5), ("ss", 8, 4)]);
    let error = machine.attach(&machine.options()).unwrap_err();
    assert!(matches!(error, UsbipError::NoFreePort(2)), "{error}");
    assert!(error.to_string().contains("usbip detach -p"), "{error}");
    let asked = fs::read_to_string(machine.controller("attach")).unwrap();
    assert_eq!(asked, "");
}

#[test]
fn a_kernel_that_makes_no_adapter_is_told_after_the_wait() {
    let machine = Machine::new(&[("hs", 0, 4)]);
    let options = Options {
        driver_wait: Duration::from_millis(40),
        ..machine.options()
    };
    let error = machine.attach(&options).unwrap_err();
    assert!(matches!(error, UsbipError::NoAdapter(0, _)), "{error}");
    assert!(error.to_string().contains("within 40ms"), "{error}");
}

#[test]
fn a_port_that_stays_in_use_is_told_when_stopping() {
    let machine = Machine::new(&[("hs", 0, 4)]);
    let kernel = kernel(&machine, 2, LettingGo::Never);
    let options = Options {
        detach_wait: Duration::from_millis(40),
        ..machine.options()
    };
    let attached = machine.attach(&options).unwrap();
    let error = attached.stop().unwrap_err();
    assert!(matches!(error, UsbipError::StillAttached(0, _)), "{error}");
    assert!(error.to_string().contains("usbip detach -p 0"), "{error}");
    kernel.join().unwrap();
}

#[test]
fn a_file_that_is_no_status_is_quoted() {
    let machine = Machine::new(&[]);
    fs::write(machine.controller("status"), "header\nhs zero\n").unwrap();
    let error = machine.attach(&machine.options()).unwrap_err().to_string();
    let quoted = "status: not a line of ports: \"hs zero\"";
    assert!(error.contains(quoted), "{error}");
}

#[test]
fn without_the_right_to_attach_the_error_names_root() {
    let machine = Machine::new(&[("hs", 0, 4)]);
    // A folder is not writable either, and unlike a read-only file it stops even root.
    fs::remove_file(machine.controller("attach")).unwrap();
    fs::create_dir(machine.controller("attach")).unwrap();
    let error = machine.attach(&machine.options()).unwrap_err();
    assert!(matches!(error, UsbipError::Sysfs { .. }), "{error}");
    // The guest tests cover the refusal itself, with a user who is not root.
    let error = UsbipError::NotRoot(machine.controller("attach"));
    assert!(error.to_string().contains("run as root"));
}

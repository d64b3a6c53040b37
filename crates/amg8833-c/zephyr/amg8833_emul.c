/* The emulated AMG8833 as an emulator of Zephyr, for tests of its driver `amg88xx` and of applications on native_sim.
 *
 * It was compiled against a stub of Zephyr's headers, as of Zephyr 3.7, and run by tests/c_library/zephyr.c. It was not run
 * in Zephyr. native_sim is a 32-bit program: build the library with `--target i686-unknown-linux-gnu`, or the application for
 * native_sim/native/64. In the application:
 *
 *   CMakeLists.txt   target_sources(app PRIVATE amg8833_emul.c)
 *                    target_include_directories(app PRIVATE crates/amg8833-c/include)
 *                    target_link_libraries(app PRIVATE libamg8833_c.a)
 *   prj.conf         CONFIG_EMUL=y  CONFIG_I2C_EMUL=y  CONFIG_SENSOR=y
 *   app.overlay      &i2c0 { amg88xx@69 { compatible = "panasonic,amg88xx"; reg = <0x69>; }; };
 *
 * The sensor's time is Zephyr's. A test sets the temperature by Zephyr's emul_sensor_backend_set_channel(), or plugs in
 * whatever amg8833.h offers: amg8833_emul_bus(EMUL_DT_GET(node)) is its bus. The INT pin is not wired to a GPIO.
 */
#define DT_DRV_COMPAT panasonic_amg88xx

#include <errno.h>
#include <zephyr/device.h>
#include <zephyr/drivers/emul.h>
#include <zephyr/drivers/emul_sensor.h>
#include <zephyr/drivers/i2c.h>
#include <zephyr/drivers/i2c_emul.h>
#include <zephyr/kernel.h>

#include <amg8833.h>

/* The chip is some degrees warmer than what it sees. */
#define SELF_HEATING_C 4.5f
#define ROOM_C 21.5f

struct amg8833_emul_cfg {
	uint16_t addr;
};

struct amg8833_emul_data {
	amg8833_bus bus;
};

amg8833_bus *amg8833_emul_bus(const struct emul *target)
{
	struct amg8833_emul_data *data = target->data;

	return &data->bus;
}

static void follow_time(amg8833_bus *bus)
{
	const uint64_t zephyr_ns = k_ticks_to_ns_floor64(k_uptime_ticks());
	uint64_t now_ns = 0;

	amg8833_now_ns(bus, &now_ns);
	if (now_ns < zephyr_ns) {
		amg8833_advance_ns(bus, zephyr_ns - now_ns);
	}
}

static amg8833_error carry(amg8833_bus *bus, const struct i2c_msg *msg)
{
	amg8833_error error = AMG8833_OK;

	for (uint32_t at = 0; at < msg->len && error == AMG8833_OK; at++) {
		error = (msg->flags & I2C_MSG_READ) ? amg8833_receive(bus, &msg->buf[at])
						    : amg8833_send(bus, msg->buf[at]);
	}
	return error;
}

/* A message begins with a START if it is the first, after a STOP, of the other direction, or asks for one. */
static int amg8833_emul_transfer(const struct emul *target, struct i2c_msg *msgs, int num_msgs, int addr)
{
	amg8833_bus *bus = amg8833_emul_bus(target);
	amg8833_error error = AMG8833_OK;
	int open = -1;

	follow_time(bus);
	for (int at = 0; at < num_msgs && error == AMG8833_OK; at++) {
		const int is_read = (msgs[at].flags & I2C_MSG_READ) != 0;

		if (open != is_read || (msgs[at].flags & I2C_MSG_RESTART)) {
			error = amg8833_start(bus, (uint8_t)addr, is_read);
			open = is_read;
		}
		if (error == AMG8833_OK) {
			error = carry(bus, &msgs[at]);
		}
		if (msgs[at].flags & I2C_MSG_STOP) {
			amg8833_stop(bus);
			open = -1;
		}
	}
	/* After an error, and at the end of the transfer; not open is no error here. */
	amg8833_stop(bus);
	return error == AMG8833_OK ? 0 : error == AMG8833_TIMEOUT ? -ETIMEDOUT : -EIO;
}

static int amg8833_emul_set_channel(const struct emul *target, struct sensor_chan_spec ch, const q31_t *value,
				    int8_t shift)
{
	const struct amg8833_emul_cfg *cfg = target->cfg;
	const double celsius = (double)*value * (double)(1ULL << shift) / 2147483648.0;

	if (ch.chan_type != SENSOR_CHAN_AMBIENT_TEMP || shift < 0) {
		return -ENOTSUP;
	}
	follow_time(amg8833_emul_bus(target));
	return amg8833_plug_celsius(amg8833_emul_bus(target), (uint8_t)cfg->addr, (float)celsius,
				    (float)celsius + SELF_HEATING_C) == AMG8833_OK
		       ? 0
		       : -EIO;
}

/* Transfers take no time of their own: Zephyr's time goes on meanwhile. */
static int amg8833_emul_init(const struct emul *target, const struct device *parent)
{
	const struct amg8833_emul_cfg *cfg = target->cfg;
	amg8833_bus *bus = amg8833_emul_bus(target);

	(void)parent;
	if (amg8833_init(bus, sizeof(*bus), 0) != AMG8833_OK) {
		return -EINVAL;
	}
	return amg8833_plug_celsius(bus, (uint8_t)cfg->addr, ROOM_C, ROOM_C + SELF_HEATING_C) == AMG8833_OK ? 0 : -EINVAL;
}

static const struct i2c_emul_api amg8833_emul_api_i2c = {
	.transfer = amg8833_emul_transfer,
};

static const struct emul_sensor_driver_api amg8833_emul_api_sensor = {
	.set_channel = amg8833_emul_set_channel,
};

#define AMG8833_EMUL(n)                                                                            \
	static struct amg8833_emul_data amg8833_emul_data_##n;                                     \
	static const struct amg8833_emul_cfg amg8833_emul_cfg_##n = {.addr = DT_INST_REG_ADDR(n)}; \
	EMUL_DT_INST_DEFINE(n, amg8833_emul_init, &amg8833_emul_data_##n, &amg8833_emul_cfg_##n,   \
			    &amg8833_emul_api_i2c, &amg8833_emul_api_sensor);

DT_INST_FOREACH_STATUS_OKAY(AMG8833_EMUL)

#!/bin/sh
# Start systemd as process 1 of a folder with a Debian, in namespaces of its own: machine.sh FOLDER. Needs root.
# systemd gets a control group of its own and cannot change the settings of the kernel.
set -e
if [ "$2" != inside ]; then
	for group in /sys/fs/cgroup /sys/fs/cgroup/unified /sys/fs/cgroup/systemd; do
		if [ -e "$group/cgroup.procs" ]; then
			mkdir "$group/pneuforce-$$" && echo $$ > "$group/pneuforce-$$/cgroup.procs"
		fi
	done
	exec unshare --pid --mount --uts --ipc --net --cgroup --kill-child --fork "$0" "$1" inside
fi

cd "$1"
mount --make-rprivate /
mount --bind . .
cd "$PWD"
mount -t proc proc proc
mount --bind proc/sys proc/sys
mount -o remount,bind,ro proc/sys
mount -t sysfs -o ro sysfs sys
mount -t tmpfs tmpfs run
mount -t tmpfs -o mode=755 tmpfs dev
for device in null zero full random urandom tty; do
	touch dev/$device
	mount --bind /dev/$device dev/$device
done
mkdir dev/pts dev/shm
mount -t devpts -o newinstance,ptmxmode=0666,mode=0620,gid=5 devpts dev/pts
ln -s pts/ptmx dev/ptmx
mount -t tmpfs tmpfs dev/shm
if [ -e /sys/fs/cgroup/cgroup.procs ]; then
	mount -t cgroup2 cgroup2 sys/fs/cgroup
else
	mount -t tmpfs tmpfs sys/fs/cgroup
	mkdir sys/fs/cgroup/unified sys/fs/cgroup/systemd
	mount -t cgroup2 cgroup2 sys/fs/cgroup/unified
	mount -t cgroup -o none,name=systemd cgroup sys/fs/cgroup/systemd
fi
exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin container=lxc chroot . /lib/systemd/systemd --system --show-status=0

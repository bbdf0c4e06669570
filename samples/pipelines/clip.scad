// A U-shaped clip: two leaves of 2 mm on a back of 4 mm, with a hole through the back.
difference() {
  cube([40, 10, 16]);
  translate([4, -1, 2]) cube([40, 12, 12]);
  translate([-1, 5, 8]) rotate([0, 90, 0]) cylinder(d = 4, h = 10, $fn = 48);
}

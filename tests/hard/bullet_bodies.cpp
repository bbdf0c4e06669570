// Blocks of cells as soft bodies of Bullet, for tests/hard/peers.py: nodes joined by the springs of a lattice
// (28 a cell), faces on the outside, Bullet's own solver, steps of 1/240 s. Lengths are in cells.
//   hard_bullet stack COUNT SECONDS      plates of 2 x 2 x 1 cells on a rigid floor: drift and jitter after a
//   second hard_bullet hit MASS_RATIO           a heavy block meets a light one: the light one's speed over
//   the heavy one's hard_bullet overlap DEPTH            two blocks of 3^3 cells that begin DEPTH inside each
//   other: the largest speed
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace {

struct World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};

  explicit World(double gravity) {
    world.setGravity(btVector3(0, 0, btScalar(-gravity)));
    world.getWorldInfo().m_gravity = world.getGravity();
    world.getWorldInfo().m_sparsesdf.Initialize();
  }
};

btSoftBody* block(World& world, std::array<int, 3> cells, btVector3 at, double mass) {
  const std::array<int, 3> n{cells[0] + 1, cells[1] + 1, cells[2] + 1};
  const auto number = [&](int i, int j, int k) { return (k * n[1] + j) * n[0] + i; };
  std::vector<btVector3> nodes;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) nodes.push_back(at + btVector3(btScalar(i), btScalar(j), btScalar(k)));
  std::vector<btScalar> masses(nodes.size(), 1);
  auto* body = new btSoftBody(&world.world.getWorldInfo(), int(nodes.size()), nodes.data(), masses.data());
  auto* material = body->appendMaterial();
  material->m_kLST = 1;
  std::map<std::pair<int, int>, int> links, faces;
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        for (int a = 0; a < 8; ++a)
          for (int b = a + 1; b < 8; ++b)
            ++links[{number(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2)),
                     number(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2))}];
  for (const auto& [link, count] : links) body->appendLink(link.first, link.second, material);
  const auto quad = [&](int a, int b, int c, int d) {
    body->appendFace(a, b, c);
    body->appendFace(a, c, d);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < cells[std::size_t(u)]; ++i)
        for (int j = 0; j < cells[std::size_t(v)]; ++j) {
          const auto at_corner = [&](int p, int q) {
            std::array<int, 3> index{};
            index[std::size_t(axis)] = side * cells[std::size_t(axis)];
            index[std::size_t(u)] = i + p;
            index[std::size_t(v)] = j + q;
            return number(index[0], index[1], index[2]);
          };
          if (side)
            quad(at_corner(0, 0), at_corner(1, 0), at_corner(1, 1), at_corner(0, 1));
          else
            quad(at_corner(0, 0), at_corner(0, 1), at_corner(1, 1), at_corner(1, 0));
        }
  }
  body->setTotalMass(btScalar(mass), false);
  body->m_cfg.collisions = btSoftBody::fCollision::SDF_RS | btSoftBody::fCollision::VF_SS;
  body->m_cfg.piterations = 20;
  body->m_cfg.kDF = btScalar(0.5);
  body->getCollisionShape()->setMargin(btScalar(0.02));
  world.world.addSoftBody(body);
  return body;
}

btVector3 mean(const btSoftBody* body, btVector3 btSoftBody::Node::*what) {
  btVector3 sum(0, 0, 0);
  for (int n = 0; n < body->m_nodes.size(); ++n) sum += body->m_nodes[n].*what;
  return sum / btScalar(body->m_nodes.size());
}

double fastest(const btSoftBody* body) {
  double most = 0;
  for (int n = 0; n < body->m_nodes.size(); ++n) most = std::max(most, double(body->m_nodes[n].m_v.length()));
  return most;
}

constexpr double kStep = 1.0 / 240;

void stack(int count, double seconds, double gap) {
  World world(981);  // cells of 1 cm
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  btRigidBody floor(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
  world.world.addRigidBody(&floor);
  std::vector<btSoftBody*> plates;
  for (int n = 0; n < count; ++n)
    plates.push_back(
        block(world, {2, 2, 1}, btVector3(btScalar(0.1 * (n % 2)), 0, btScalar(gap + n * (1 + gap))), 4));
  std::vector<btVector3> first, low, high;
  for (int step = 1; step * kStep <= seconds; ++step) {
    world.world.stepSimulation(btScalar(kStep), 1, btScalar(kStep));
    if (step * kStep < 1) continue;
    std::vector<btVector3> now;
    for (const auto* plate : plates) now.push_back(mean(plate, &btSoftBody::Node::m_x));
    if (first.empty()) first = low = high = now;
    for (std::size_t n = 0; n < now.size(); ++n) {
      low[n].setMin(now[n]);
      high[n].setMax(now[n]);
    }
  }
  double drift = 0, jitter = 0;
  for (std::size_t n = 0; n < plates.size(); ++n) {
    drift = std::max(drift, double((mean(plates[n], &btSoftBody::Node::m_x) - first[n]).length()));
    jitter = std::max(jitter, double((high[n] - low[n]).length()));
  }
  std::printf("drift %g\njitter %g\ntop %g\n", drift, jitter,
              double(mean(plates.back(), &btSoftBody::Node::m_x).z()) - count + 0.5);
}

void hit(double ratio) {
  World world(0);
  auto* heavy = block(world, {3, 3, 3}, btVector3(0, 0, 0), 27 * ratio);
  auto* light = block(world, {3, 3, 3}, btVector3(btScalar(3.2), 0, 0), 27);
  heavy->addVelocity(btVector3(20, 0, 0));
  for (int step = 0; step < 120; ++step) world.world.stepSimulation(btScalar(kStep), 1, btScalar(kStep));
  std::printf("speed %g\n", double(mean(light, &btSoftBody::Node::m_v).x()) / 20);
  std::printf("gap %g\n",
              double(mean(light, &btSoftBody::Node::m_x).x() - mean(heavy, &btSoftBody::Node::m_x).x()) - 3);
}

void overlap(double depth) {
  World world(0);
  auto* low = block(world, {3, 3, 3}, btVector3(0, 0, 0), 27);
  auto* high = block(world, {3, 3, 3}, btVector3(btScalar(0.1), btScalar(0.2), btScalar(3 - depth)), 27);
  double most = 0;
  for (int step = 0; step < 240; ++step) {
    world.world.stepSimulation(btScalar(kStep), 1, btScalar(kStep));
    most = std::max({most, fastest(low), fastest(high)});
  }
  std::printf("speed %g\n", most);
  std::printf("gap %g\n",
              double(mean(high, &btSoftBody::Node::m_x).z() - mean(low, &btSoftBody::Node::m_x).z()) - 3);
}

}  // namespace

int main(int count, char** words) {
  if (count == 5 && !std::strcmp(words[1], "stack"))
    stack(std::atoi(words[2]), std::atof(words[3]), std::atof(words[4]));
  else if (count == 3 && !std::strcmp(words[1], "hit"))
    hit(std::atof(words[2]));
  else if (count == 3 && !std::strcmp(words[1], "overlap"))
    overlap(std::atof(words[2]));
  else
    return 2;
  std::fflush(stdout);
  std::_Exit(0);  // nothing of Bullet's worlds is taken down
}

// SPDX-License-Identifier: MIT
// Textured scans with bytes bent, cut or doubled: a sentence or a scan, never more.

#include <fstream>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/layout/textured_scan.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::ScratchDirectory;

constexpr const char* kMaterials =
    "newmtl a b\nKd 0.5 0.25 1\nmap_Kd -s 2 2 1 -o 0.1 0 0 -clamp on -mm 0 1 p.png\n"
    "newmtl c\nKd 0.1\nmap_Kd p.png\n";
constexpr const char* kObj =
    "mtllib m.mtl\nv 0 0 0\nv 1 0 0 \\\n\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt -3 1e3\n"
    "usemtl a b\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl c\nf -4/-4 -3/-3 -1/-1\nf 1 2 3\nf 1// 2//2 "
    "3/\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\ncomment TextureFile p.png\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 3\n"
    "property list uchar int vertex_indices\nproperty list uchar float texcoord\n"
    "property uchar texnumber\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n"
    "3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 0 0\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 7\n";

std::string binary_ply() {
  std::string text =
      "ply\nformat binary_little_endian 1.0\ncomment TextureFile p.png\nelement vertex 3\n"
      "property float x\nproperty double y\nproperty short z\nelement face 1\n"
      "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n";
  const auto put = [&](auto value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (int v = 0; v < 3; ++v) {
    put(static_cast<float>(v));
    put(static_cast<double>(v * v));
    put(static_cast<std::int16_t>(v));
  }
  put(std::uint8_t{3});
  for (int v = 0; v < 3; ++v) {
    put(v);
  }
  put(std::uint8_t{6});
  for (int v = 0; v < 6; ++v) {
    put(static_cast<float>(v) / 5.0F);
  }
  return text;
}

std::string bent(std::string text, std::mt19937& random) {
  const std::size_t at = random() % text.size();
  switch (random() % 4) {
    case 0:
      text[at] = static_cast<char>(random());
      break;
    case 1:
      text.resize(at);
      break;
    case 2:
      text.insert(at, text.substr(at / 2, random() % 20));
      break;
    default:
      text[at] = "0123456789-/. \n"[random() % 15];
  }
  return text;
}

/// Whether it could be read; looks colours up then.
bool read(const std::string& path) {
  try {
    const TextureOutline outline = outline_textures(path);
    const TexturedScan scan(path, outline, Vec3d::Zero());
    if (scan.triangles() > 0) {
      const Vec3d p(0.3, 0.2, 0.0);
      const std::uint32_t t = scan.nearest(p);
      for (const double c : scan.colour(t, scan.texture(t, p))) {
        EXPECT_GE(c, 0.0);
        EXPECT_LE(c, 255.5);
      }
    }
    return true;
  } catch (const InputError& error) {
    EXPECT_GT(std::string(error.what()).size(), 20U);
    return false;
  }
}

class Mutations : public ::testing::TestWithParam<const char*> {};

TEST_P(Mutations, GiveASentenceOrAScan) {
  const ScratchDirectory folder;
  const std::string kind = GetParam();
  const std::string name = kind == "obj" || kind == "mtl" ? "t.obj" : "t.ply";
  const std::string mutated = kind == "mtl" ? "m.mtl" : name;
  Image picture(3, 2, {10, 200, 30});
  write_png(picture, folder.file("p.png"));
  std::ofstream(folder.file("m.mtl")) << kMaterials;
  std::ofstream(folder.file("t.obj")) << kObj;
  std::ofstream(folder.file("t.ply"), std::ios::binary)
      << (kind == "binary" ? binary_ply() : std::string(kPly));
  const std::string whole = read_file(folder.file(mutated));
  ASSERT_TRUE(read(folder.file(name)));
  std::mt19937 random(7);
  int readable = 0;
  constexpr int kRounds = 150;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = bent(whole, random);
    for (std::uint32_t more = random() % 3; more > 0 && !text.empty(); --more) {
      text = bent(text, random);
    }
    std::ofstream(folder.file(mutated), std::ios::binary) << text;
    readable += read(folder.file(name)) ? 1 : 0;
  }
  EXPECT_GT(readable, 0);
  EXPECT_LT(readable, kRounds);
}

INSTANTIATE_TEST_SUITE_P(TexturedScans, Mutations,
                         ::testing::Values("obj", "mtl", "text", "binary"));

}  // namespace
}  // namespace rattan

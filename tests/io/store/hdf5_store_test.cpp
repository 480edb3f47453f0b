// SPDX-License-Identifier: MIT
#include "io/store/hdf5_store.h"

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/memory_store.h"
#include "engine/mesh/ingest.h"
#include "tests/io/store/random_chunk.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;

using test::chunk;

/// A directory of its own for each test.
class Hdf5StoreTest : public ::testing::Test {
 protected:
  Hdf5StoreTest() {
    std::string name = (fs::temp_directory_path() / "rattan_store_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
    base_ = name;
  }
  ~Hdf5StoreTest() override { fs::remove_all(base_); }

  Hdf5StoreOptions options(std::uint64_t cache_bytes, bool keep) const {
    return {.directory = base_ / "work", .cache_bytes = cache_bytes, .keep = keep};
  }
  fs::path file(const char* name) const { return base_ / "work" / name; }

  fs::path base_;
};

void expect_chunk(Store& store, const std::string& field, std::uint32_t tile, std::uint32_t seed,
                  std::size_t size) {
  EXPECT_EQ(*store.read_chunk(field, TileId(tile)), *chunk(seed, size)) << field << " " << tile;
}

TEST_F(Hdf5StoreTest, ALargeCacheNeverTouchesTheDisk) {
  {
    Hdf5Store store(options(1 << 20, false));
    for (std::uint32_t t = 0; t < 10; ++t) {
      store.write_chunk("a/x", TileId(t), chunk(t, 1000));
    }
    store.checkpoint();
    expect_chunk(store, "a/x", 3, 3, 1000);
    EXPECT_FALSE(store.has_checkpoint());
    EXPECT_EQ(store.cached_bytes(), 10000U);
    EXPECT_EQ(store.bytes_written(), 0U);
    EXPECT_EQ(store.bytes_moved(), 11000U);
  }
  EXPECT_FALSE(fs::exists(base_ / "work"));
}

TEST_F(Hdf5StoreTest, ATinyCacheGivesTheSameData) {
  {
    Hdf5Store store(options(5000, false));
    std::mt19937 random(1);
    std::vector<std::pair<std::uint32_t, std::size_t>> last(40);  // seed and size per chunk
    for (std::uint32_t round = 0; round < 600; ++round) {
      const std::uint32_t tile = random() % 20;
      const std::uint32_t field = random() % 2;
      const std::size_t size = random() % 1500;
      store.write_chunk(field == 0 ? "a/x" : "b/y/z", TileId(tile), chunk(round + 1, size));
      last[20 * field + tile] = {round + 1, size};
      const std::uint32_t other = random() % 40;
      if (last[other].first != 0) {
        expect_chunk(store, other < 20 ? "a/x" : "b/y/z", other % 20, last[other].first,
                     last[other].second);
      }
      EXPECT_LE(store.cached_bytes(), 5000U);
      if (round == 300) {
        store.erase("a/x");
        EXPECT_FALSE(store.has_chunk("a/x", TileId(0)));
        EXPECT_THROW(store.read_chunk("a/x", TileId(0)), InternalError);
        std::fill(last.begin(), last.begin() + 20, std::pair<std::uint32_t, std::size_t>());
      }
    }
    EXPECT_GT(store.bytes_read(), 0U);
    EXPECT_GT(store.bytes_written(), 0U);
    EXPECT_GE(store.bytes_moved(), store.bytes_read());
    EXPECT_TRUE(fs::exists(file("a.1.h5.partial")));
    EXPECT_GT(store.peak_disk_bytes(), 10000U);
  }
  EXPECT_FALSE(fs::exists(base_ / "work"));
}

TEST_F(Hdf5StoreTest, ThreadsSeeWhatTheyWrote) {
  Hdf5Store store(options(20000, false));
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::uint32_t n = 0; n < 4; ++n) {
    threads.emplace_back([&, n] {
      const std::string mine = "a/field" + std::to_string(n);
      for (std::uint32_t round = 0; round < 10; ++round) {
        for (std::uint32_t t = 0; t < 30; ++t) {
          store.write_chunk(mine, TileId(t), chunk(1000 * round + t, 700 + 10 * round));
        }
        for (std::uint32_t t = 0; t < 30; ++t) {
          wrong += *store.read_chunk(mine, TileId(t)) != *chunk(1000 * round + t, 700 + 10 * round)
                       ? 1
                       : 0;
        }
        if (round % 4 == 3) {
          store.erase(mine);
        }
      }
    });
  }
  for (std::thread& t : threads) {
    t.join();
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(Hdf5StoreTest, ReadersShareOneField) {
  Hdf5Store store(options(3000, false));
  for (std::uint32_t t = 0; t < 50; ++t) {
    store.write_chunk("a/x", TileId(t), chunk(t, 500));
  }
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::uint32_t n = 0; n < 4; ++n) {
    threads.emplace_back([&, n] {
      for (std::uint32_t k = 0; k < 200; ++k) {
        const std::uint32_t t = (k * (n + 1)) % 50;
        wrong += *store.read_chunk("a/x", TileId(t)) != *chunk(t, 500) ? 1 : 0;
      }
    });
  }
  for (std::thread& t : threads) {
    t.join();
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(Hdf5StoreTest, ACheckpointComesBack) {
  for (const std::uint64_t cache : {std::uint64_t{1000}, std::uint64_t{1} << 20}) {
    std::vector<Hdf5Store::FieldState> fields;
    {
      Hdf5Store store(options(cache, true));
      for (std::uint32_t t = 0; t < 20; ++t) {
        store.write_chunk("mesh/x", TileId(t), chunk(t, 300 + t));
        store.write_chunk("mesh/deep/y", TileId(t), chunk(100 + t, t % 3));
        store.write_chunk("gone/z", TileId(t), chunk(200 + t, 300));
      }
      store.erase("gone/z");
      store.write_chunk("mesh/x", kBoardTile, chunk(77, 40));
      store.set_note("options", "{}");
      fields = store.fields();
      EXPECT_EQ(store.unsaved_bytes() == 20 * 300U + 190 + 20 - 1 + 40, cache > 1000);
      store.checkpoint();
      EXPECT_EQ(store.unsaved_bytes(), 0U);
      store.settle();
      EXPECT_TRUE(store.has_checkpoint());
      EXPECT_TRUE(fs::exists(file("mesh.1.h5")));
      EXPECT_FALSE(fs::exists(file("gone.1.h5")));
      expect_chunk(store, "mesh/x", 5, 5, 305);
      store.write_chunk("mesh/x", TileId(5), chunk(55, 305));  // not in the checkpoint
      store.write_chunk("later/x", TileId(0), chunk(0, 3000));
      store.erase("mesh/deep/y");
    }
    EXPECT_FALSE(fs::exists(file("mesh.2.h5.partial")));
    {
      Hdf5Store store(options(cache, true));
      EXPECT_EQ(store.fields(), fields);
      EXPECT_FALSE(store.has_chunk("later/x", TileId(0)));
      EXPECT_EQ(store.note("options"), "{}");
      EXPECT_EQ(store.note("nothing"), std::nullopt);
      for (std::uint32_t t = 0; t < 20; ++t) {
        expect_chunk(store, "mesh/x", t, t, 300 + t);
        expect_chunk(store, "mesh/deep/y", t, 100 + t, t % 3);
      }
      expect_chunk(store, "mesh/x", kBoardTile.value, 77, 40);
      const auto stages = store.list();
      ASSERT_EQ(stages.size(), 1U);
      EXPECT_EQ(stages[0].name, "mesh");
      EXPECT_GT(stages[0].file_bytes, 6000U);
      ASSERT_EQ(stages[0].fields.size(), 2U);
      EXPECT_EQ(stages[0].fields[0].name, "mesh/deep/y");
      EXPECT_EQ(stages[0].fields[1].chunks, 21U);
      EXPECT_EQ(stages[0].fields[1].bytes, 20 * 300U + 190 + 40);
    }
    fs::remove_all(base_ / "work");
  }
}

// Whatever is written, replaced and erased, with checkpoints in between: after each of them, and
// after the process ended anywhere behind it, the store is what it was then.
TEST_F(Hdf5StoreTest, EveryCheckpointIsTheStoreOfThatTime) {
  std::mt19937 random(7);
  using Content = std::map<std::pair<std::string, std::uint32_t>, std::pair<std::uint32_t, int>>;
  Content now;
  Content saved;
  auto store = std::make_unique<Hdf5Store>(options(3000, true));
  for (std::uint32_t round = 1; round < 500; ++round) {
    const std::string field =
        std::string(random() % 2 == 0 ? "a/x" : "b/x") + static_cast<char>('0' + random() % 3);
    const std::uint32_t dice = random() % 100;
    if (dice < 80) {
      const std::uint32_t tile = random() % 8;
      const int size = static_cast<int>(random() % 900);
      store->write_chunk(field, TileId(tile), chunk(round, static_cast<std::size_t>(size)));
      now[{field, tile}] = {round, size};
    } else if (dice < 85) {
      store->erase(field);
      std::erase_if(now, [&](const auto& entry) { return entry.first.first == field; });
    } else if (dice < 93) {
      store->checkpoint();
      saved = now;
    } else {
      store.reset();  // what is not in the checkpoint is lost
      store = std::make_unique<Hdf5Store>(options(3000, true));
      now = saved;
    }
    if (round % 20 == 0 || dice >= 93) {
      for (const auto& [key, value] : now) {
        expect_chunk(*store, key.first, key.second, value.first,
                     static_cast<std::size_t>(value.second));
      }
      for (std::uint32_t t = 0; t < 8; ++t) {
        EXPECT_EQ(store->has_chunk("a/x1", TileId(t)), now.contains({"a/x1", t}));
      }
    }
  }
  store->set_keep(false);
  store.reset();
  EXPECT_FALSE(fs::exists(base_ / "work"));
}

TEST_F(Hdf5StoreTest, FilesThatNothingNeedsGo) {
  Hdf5Store store(options(1 << 20, true));
  for (int round = 0; round < 5; ++round) {
    store.write_chunk("a/x", TileId(0), chunk(1, 50000));
    store.checkpoint();
  }
  store.settle();
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(base_ / "work")) {
    ++files;
  }
  EXPECT_EQ(files, 2);  // the data and the record
  EXPECT_LE(store.peak_disk_bytes(), 4 * 50000U);
}

TEST_F(Hdf5StoreTest, WorkThatSucceededNeedNotStay) {
  {
    Hdf5Store store(options(100, true));
    store.write_chunk("a/x", TileId(0), chunk(1, 1000));
    store.checkpoint();
    store.settle();
    EXPECT_TRUE(fs::exists(file("a.1.h5")));
    store.set_keep(false);
  }
  EXPECT_FALSE(fs::exists(base_ / "work"));
}

TEST_F(Hdf5StoreTest, AFreshStartForgets) {
  {
    Hdf5Store store(options(100, true));
    store.write_chunk("a/x", TileId(0), chunk(1, 1000));
    store.checkpoint();
  }
  Hdf5StoreOptions anew = options(100, true);
  anew.fresh = true;
  const Hdf5Store store(anew);
  EXPECT_FALSE(store.has_chunk("a/x", TileId(0)));
  EXPECT_FALSE(store.has_checkpoint());
  EXPECT_FALSE(fs::exists(file("a.1.h5")));
  EXPECT_FALSE(fs::exists(file("checkpoint")));
}

TEST_F(Hdf5StoreTest, LeftoversOfAKilledRunGoAndLookingChangesNothing) {
  fs::create_directories(base_ / "work");
  std::ofstream(file("a.1.h5.partial")) << "half a file";
  std::ofstream(file("b.3.h5")) << "of a checkpoint that never stood";
  std::ofstream(file("notes.txt")) << "mine";
  {
    Hdf5StoreOptions look = options(100, true);
    look.read_only = true;
    const Hdf5Store store(look);
    EXPECT_TRUE(store.list().empty());
  }
  EXPECT_TRUE(fs::exists(file("a.1.h5.partial")));
  { const Hdf5Store store(options(100, false)); }
  EXPECT_FALSE(fs::exists(file("a.1.h5.partial")));
  EXPECT_FALSE(fs::exists(file("b.3.h5")));
  EXPECT_TRUE(fs::exists(file("notes.txt")));
}

TEST_F(Hdf5StoreTest, EqualWorkGivesEqualFiles) {
  std::vector<std::string> files;
  for (int run = 0; run < 2; ++run) {
    {
      Hdf5Store store(options(1 << 20, true));
      for (std::uint32_t k = 0; k < 20; ++k) {
        const std::uint32_t t = run == 0 ? k : 19 - k;
        store.write_chunk("a/x", TileId(t), chunk(t, 400));
        store.write_chunk("a/y", TileId(t), chunk(t, 30));
      }
      store.checkpoint();
    }
    std::ifstream in(file("a.1.h5"), std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    EXPECT_GT(files.back().size(), 8000U);
    fs::remove_all(base_ / "work");
  }
  EXPECT_EQ(files[0], files[1]);
}

// Damage in every byte: store_damage_test.cpp.
TEST_F(Hdf5StoreTest, WhatADamagedFileHeldIsGone) {
  const auto make = [&] {
    fs::remove_all(base_ / "work");
    Hdf5Store store(options(1 << 20, true));
    store.write_chunk("a/x", TileId(0), chunk(0, 700));
    store.write_chunk("b/x", TileId(0), chunk(1, 700));
    store.checkpoint();
  };
  const auto check = [&](const char* damaged, bool a_left, bool b_left) {
    Hdf5StoreOptions look = options(100, true);
    look.read_only = true;
    EXPECT_THROW(Hdf5Store{look}, DamagedFile) << damaged;
    const Hdf5Store store(options(1 << 20, true));
    ASSERT_EQ(store.damage().size(), 1U) << damaged;
    EXPECT_NE(store.damage()[0].find(damaged), std::string::npos);
    EXPECT_EQ(store.has_chunk("a/x", TileId(0)), a_left);
    EXPECT_EQ(store.has_chunk("b/x", TileId(0)), b_left);
  };
  make();
  std::ofstream(file("a.1.h5")) << "no HDF5";
  check("a.1.h5", false, true);
  make();
  fs::remove(file("b.1.h5"));
  check("b.1.h5", true, false);
  make();
  fs::copy_file(file("a.1.h5"), file("b.1.h5"), fs::copy_options::overwrite_existing);
  check("b.1.h5", true, false);
  make();
  fs::resize_file(file("checkpoint"), fs::file_size(file("checkpoint")) - 1);
  check("checkpoint", false, false);
}

TEST_F(Hdf5StoreTest, AFullDiskIsAResourceError) {
  const auto fill_disk = [this] {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit small{};
    small.rlim_cur = small.rlim_max = 400000;
    ::setrlimit(RLIMIT_FSIZE, &small);
    int code = 1;
    try {
      Hdf5Store store(options(10000, false));
      for (std::uint32_t t = 0; t < 100; ++t) {
        store.write_chunk("a/x", TileId(t), chunk(t, 9000));
      }
    } catch (const ResourceError& e) {
      const std::string text = e.what();
      const bool names_both = text.find("a.1.h5.partial") != std::string::npos &&
                              text.find("disk is full") != std::string::npos &&
                              text.find("are needed") != std::string::npos;
      code = names_both ? 42 : 2;
    }
    std::_Exit(code);
  };
  EXPECT_EXIT(fill_disk(), ::testing::ExitedWithCode(42), "");
}

TEST_F(Hdf5StoreTest, ACheckpointThatFailsLeavesTheOneBefore) {
  const auto fill_disk = [this] {
    std::signal(SIGXFSZ, SIG_IGN);
    int code = 1;
    try {
      Hdf5Store store(options(1 << 24, true));
      store.write_chunk("a/x", TileId(0), chunk(1, 9000));
      store.checkpoint();
      store.settle();
      rlimit small{};
      small.rlim_cur = small.rlim_max = 400000;
      ::setrlimit(RLIMIT_FSIZE, &small);
      store.write_chunk("a/x", TileId(0), chunk(2, 9000));
      store.write_chunk("a/y", TileId(0), chunk(3, 900000));
      store.checkpoint();
      store.settle();
    } catch (const ResourceError&) {
      code = 42;
    }
    std::_Exit(code);
  };
  EXPECT_EXIT(fill_disk(), ::testing::ExitedWithCode(42), "");
  Hdf5Store store(options(1 << 20, true));
  expect_chunk(store, "a/x", 0, 1, 9000);
  EXPECT_FALSE(store.has_chunk("a/y", TileId(0)));
  EXPECT_TRUE(store.damage().empty());
}

TEST_F(Hdf5StoreTest, AnUnusableDirectoryIsAResourceError) {
  std::ofstream(base_ / "work") << "a file in the way";
  Hdf5Store store(options(10, false));
  EXPECT_THROW(store.write_chunk("a/x", TileId(0), chunk(0, 100)), ResourceError);
}

TEST_F(Hdf5StoreTest, IngestThroughATinyCacheAgreesWithMemory) {
  const auto run = [](Store& store, std::uint64_t memory) {
    Ingest in(store, {.tile_size = 64, .memory_bytes = memory, .spool_block_bytes = 4000});
    std::vector<Vec3d> positions;
    std::vector<std::array<std::uint64_t, 3>> triangles;
    constexpr std::uint64_t kSide = 40;
    for (std::uint64_t i = 0; i < kSide * kSide; ++i) {
      positions.emplace_back(i % kSide, i / kSide, 0.1 * (i % 7));
    }
    for (std::uint64_t i = 0; i + kSide < positions.size(); ++i) {
      if (i % kSide + 1 < kSide) {
        triangles.push_back({i, i + 1, i + kSide});
        triangles.push_back({i + 1, i + kSide + 1, i + kSide});
      }
    }
    in.add_vertices(positions);
    in.add_triangles(triangles);
    TaskGraph graph;
    return in.finish(graph);
  };
  MemoryStore memory;
  const ScanMesh expected = run(memory, 1 << 20);
  Hdf5Store disk(options(3000, false));
  const ScanMesh actual = run(disk, 5000);
  EXPECT_GT(disk.bytes_written(), 50000U);
  ASSERT_EQ(actual.layout.tile_count(), expected.layout.tile_count());
  EXPECT_EQ(actual.area, expected.area);
  for (std::uint32_t t = 0; t < expected.layout.tile_count(); ++t) {
    for (const std::string_view field :
         {fields::kPosition.name, fields::kTriangle.name, fields::kVertexFlag.name,
          fields::kMeshHalo.halo_ids.name, fields::kMeshHalo.halo_slots.name,
          fields::kMeshHalo.border.name}) {
      EXPECT_EQ(*disk.read_chunk(field, TileId(t)), *memory.read_chunk(field, TileId(t))) << field;
    }
  }
}

}  // namespace
}  // namespace rattan

// SPDX-License-Identifier: MIT
#include "engine/mesh/polygon_cutter.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/mesh/external_sort.h"

namespace rattan {
namespace {

constexpr std::size_t kMaxApexes = 8;
constexpr std::size_t kBatch = 4096;

std::uint64_t mixed(std::uint64_t x) {
  x ^= x >> 32;
  x *= 0xd6e8feb86659fd93U;
  x ^= x >> 32;
  x *= 0xd6e8feb86659fd93U;
  return x ^ x >> 32;
}

std::uint64_t hash_of(std::uint64_t a, std::uint64_t b) {
  return mixed(std::min(a, b) * 0x9e3779b97f4a7c15U + mixed(std::max(a, b)));
}

// Fans that differ, as far as they are tried.
std::size_t apexes_of(std::size_t size) {
  return size == 4 ? 2 : std::min(size, kMaxApexes);
}

// f(other, a, b) for the diagonals of the fan around corner `apex`: to corner `other`, joining the
// vertices a and b.
template <class F>
void for_each_diagonal(std::span<const std::uint64_t> corners, std::size_t apex, const F& f) {
  const std::size_t n = corners.size();
  for (std::size_t k = 2; k + 1 < n; ++k) {
    const std::size_t other = (apex + k) % n;
    f(other, corners[apex], corners[other]);
  }
}

template <class F>
void for_each_side(std::span<const std::uint64_t> corners, const F& f) {
  for (std::size_t k = 0; k < corners.size(); ++k) {
    f(corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
  }
}

// A set of edges that may hold more than was put in.
class EdgeFilter {
 public:
  EdgeFilter(std::uint64_t edges, std::uint64_t memory_bytes) {
    std::uint64_t bits = 1U << 16;
    while (bits < 8 * edges && bits / 8 * 2 <= memory_bytes) {
      bits *= 2;
    }
    words_.assign(static_cast<std::size_t>(bits / 64), 0);
  }
  bool has(std::uint64_t hash) const { return (words_[word(hash)] >> (hash & 63) & 1) != 0; }
  /// Whether it was there already.
  bool put(std::uint64_t hash) {
    std::uint64_t& w = words_[word(hash)];
    const std::uint64_t bit = std::uint64_t{1} << (hash & 63);
    const bool there = (w & bit) != 0;
    w |= bit;
    return there;
  }

 private:
  std::size_t word(std::uint64_t hash) const {
    return static_cast<std::size_t>(hash >> 6) & (words_.size() - 1);
  }
  std::vector<std::uint64_t> words_;
};

/// Who wants to join a and b, or (polygon 0) that they are joined.
struct Claim {
  std::uint64_t a;
  std::uint64_t b;
  std::uint64_t polygon;    // from 1, in order
  std::uint64_t signature;  // of all its corners
};
struct HashOfClaim {
  std::uint64_t operator()(const Claim& c) const { return hash_of(c.a, c.b); }
};

struct Refused {
  std::uint64_t polygon;
  bool repeats;  // another that came before
};
constexpr std::uint32_t kDropped = ~std::uint32_t{0};
/// For polygons that are not cut around their first corner.
struct Decision {
  std::uint64_t polygon;
  std::uint32_t apex;
};
struct PolygonOf {
  template <class Record>
  std::uint64_t operator()(const Record& r) const {
    return r.polygon;
  }
};

using ClaimSort = ExternalSort<Claim, HashOfClaim>;
using RefusedSort = ExternalSort<Refused, PolygonOf>;

class Cutting {
 public:
  Cutting(Store& store, const PolygonCutter::TriangleSource& triangles,
          const PolygonCutter::Emit& emit, std::uint64_t diagonals, std::uint64_t memory_bytes)
      : store_(store),
        triangles_(triangles),
        emit_(emit),
        memory_(static_cast<std::size_t>(memory_bytes)),
        wanted_(diagonals, memory_bytes / 4),
        disputed_(diagonals, memory_bytes / 4),
        decisions_(store, "ingest/decision_run_", PolygonOf{}, memory_ / 8, 0) {}

  PolygonCutter::Counts run(Spool<std::uint64_t>& polygons) {
    find_disputes(polygons);
    // Nearly every polygon is undisputed. The others are settled exactly, a fan at a time.
    std::vector<Spool<std::uint64_t>> waiting;
    waiting.push_back(gather_disputed(polygons));
    for (std::size_t apex = 0; apex < kMaxApexes && waiting.back().size() > 0; ++apex) {
      waiting.push_back(settle(waiting.back(), apex));
      waiting[apex].erase();
    }
    for_each_polygon(waiting.back(), [&](std::uint64_t, Corners) { ++counts_.stuck; });
    decisions_.finish();
    emit_all(polygons);
    return counts_;
  }

 private:
  using Corners = std::span<const std::uint64_t>;

  // f(number, corners). A record is the number, the count of corners, the corners.
  template <class F>
  static void for_each_polygon(const Spool<std::uint64_t>& spool, const F& f) {
    std::vector<std::uint64_t> record;
    std::size_t wanted = 2;
    spool.for_each_block([&](Corners block) {
      while (!block.empty()) {
        const std::size_t take = std::min(wanted - record.size(), block.size());
        record.insert(record.end(), block.begin(),
                      block.begin() + static_cast<std::ptrdiff_t>(take));
        block = block.subspan(take);
        if (record.size() == 2) {
          wanted = 2 + static_cast<std::size_t>(record[1]);
        } else if (record.size() == wanted) {
          f(record[0], Corners(record).subspan(2));
          record.clear();
          wanted = 2;
        }
      }
    });
  }
  static void push(Spool<std::uint64_t>& spool, std::uint64_t number, Corners corners) {
    spool.push(number);
    spool.push(corners.size());
    spool.append(corners);
  }

  template <class F>
  void for_each_edge_of_triangles(const F& f) const {
    triangles_([&](std::span<const PolygonCutter::Triangle> block) {
      for (const PolygonCutter::Triangle& t : block) {
        f(t[0], t[1]);
        f(t[1], t[2]);
        f(t[2], t[0]);
      }
    });
  }

  // Afterwards a diagonal that is not in `disputed_` is wanted by one polygon and joins what
  // nothing else does.
  void find_disputes(const Spool<std::uint64_t>& polygons) {
    for_each_polygon(polygons, [&](std::uint64_t, Corners p) {
      for (std::size_t apex = 0; apex < apexes_of(p.size()); ++apex) {
        for_each_diagonal(p, apex, [&](std::size_t other, std::uint64_t a, std::uint64_t b) {
          // A diagonal between two apexes is seen from both.
          if (other > apex && wanted_.put(hash_of(a, b))) {
            disputed_.put(hash_of(a, b));
          }
        });
      }
    });
    const auto dispute = [&](std::uint64_t a, std::uint64_t b) {
      if (wanted_.has(hash_of(a, b))) {
        disputed_.put(hash_of(a, b));
      }
    };
    for_each_edge_of_triangles(dispute);
    for_each_polygon(polygons, [&](std::uint64_t, Corners p) { for_each_side(p, dispute); });
  }

  // The polygons whose first fan is disputed, and every edge of the scan that disputes one.
  Spool<std::uint64_t> gather_disputed(const Spool<std::uint64_t>& polygons) {
    Spool<std::uint64_t> waiting(store_, "ingest/disputed_0");
    Spool<Claim> joined(store_, "ingest/joined_0");
    const auto keep = [&](std::uint64_t a, std::uint64_t b) {
      if (disputed_.has(hash_of(a, b))) {
        joined.push({std::min(a, b), std::max(a, b), 0, 0});
      }
    };
    for_each_polygon(polygons, [&](std::uint64_t number, Corners p) {
      bool free = true;
      for_each_diagonal(p, 0, [&](std::size_t, std::uint64_t a, std::uint64_t b) {
        free = free && a != b && !disputed_.has(hash_of(a, b));
      });
      if (!free) {
        push(waiting, number, p);
      }
      for_each_side(p, keep);
    });
    if (waiting.size() > 0) {
      for_each_edge_of_triangles(keep);
    }
    waiting.finish();
    joined.finish();
    joined_.push_back(std::move(joined));
    return waiting;
  }

  // Every polygon claims the fan around one of its corners. Where a diagonal joins nothing that is
  // joined, the first to claim it has it. Those that have all of theirs are decided; returns the
  // others.
  Spool<std::uint64_t> settle(const Spool<std::uint64_t>& waiting, std::size_t apex) {
    RefusedSort refused(store_, "ingest/refused_run_", PolygonOf{}, memory_ / 8, 0);
    refuse_claims(waiting, apex, refused);
    refused.finish();
    Spool<std::uint64_t> losers(store_, "ingest/disputed_" + std::to_string(apex + 1));
    Spool<Claim> joined(store_, "ingest/joined_" + std::to_string(apex + 1));
    for_each_polygon(waiting, [&](std::uint64_t number, Corners p) {
      bool free = apex < apexes_of(p.size());
      bool repeats = false;
      for (; !refused.done() && refused.front().polygon == number; refused.pop()) {
        free = false;
        repeats = repeats || refused.front().repeats;
      }
      if (repeats) {
        decisions_.push({number, kDropped});
      } else if (free) {
        decisions_.push({number, static_cast<std::uint32_t>(apex)});
        for_each_diagonal(p, apex, [&](std::size_t, std::uint64_t a, std::uint64_t b) {
          joined.push({std::min(a, b), std::max(a, b), 0, 0});
        });
      } else {
        push(losers, number, p);
      }
    });
    losers.finish();
    joined.finish();
    joined_.push_back(std::move(joined));
    return losers;
  }

  void refuse_claims(const Spool<std::uint64_t>& waiting, std::size_t apex, RefusedSort& refused) {
    ClaimSort claims(store_, "ingest/claim_run_", HashOfClaim{}, memory_ / 4, 0);
    for (const Spool<Claim>& joined : joined_) {
      joined.for_each_block([&](std::span<const Claim> block) { claims.push(block); });
    }
    for_each_polygon(waiting, [&](std::uint64_t number, Corners p) {
      if (apex < apexes_of(p.size())) {
        const std::uint64_t signature = signature_of(p);
        for_each_diagonal(p, apex, [&](std::size_t, std::uint64_t a, std::uint64_t b) {
          claims.push({std::min(a, b), std::max(a, b), number, signature});
        });
      }
    });
    claims.finish();
    std::vector<Claim> group;
    while (!claims.done()) {
      group.clear();
      claims.take_key(HashOfClaim{}(claims.front()), group);
      if (group.back().polygon == 0) {
        continue;  // claims are pushed after what is joined, and there is none
      }
      std::sort(group.begin(), group.end(), [](const Claim& x, const Claim& y) {
        return std::tie(x.a, x.b, x.polygon) < std::tie(y.a, y.b, y.polygon);
      });
      for (std::size_t i = 0, j = 0; i < group.size(); i = j) {
        while (j < group.size() && group[j].a == group[i].a && group[j].b == group[i].b) {
          ++j;
        }
        refuse(std::span(group).subspan(i, j - i), refused);
      }
    }
  }

  // Claims of one edge, by polygon.
  static void refuse(std::span<Claim> claims, RefusedSort& refused) {
    const Claim first = claims.front();
    const bool useless = first.a == first.b;  // of a polygon that comes back to a vertex
    std::sort(claims.begin(), claims.end(), [](const Claim& x, const Claim& y) {
      return std::tie(x.signature, x.polygon) < std::tie(y.signature, y.polygon);
    });
    std::uint64_t copied = 0;  // the first polygon of the same corners
    for (std::size_t k = 0; k < claims.size(); ++k) {
      const Claim& c = claims[k];
      copied = k > 0 && claims[k - 1].signature == c.signature ? copied : c.polygon;
      if (c.polygon != 0 && (c.polygon != first.polygon || useless || twice(claims, k))) {
        refused.push({c.polygon, copied != 0 && copied != c.polygon});
      }
    }
  }
  // Whether the claim before is of the same polygon: it would join its vertices twice.
  static bool twice(std::span<const Claim> claims, std::size_t k) {
    return k > 0 && claims[k - 1].polygon == claims[k].polygon;
  }

  static std::uint64_t signature_of(Corners corners) {
    std::uint64_t signature = corners.size();
    for (const std::uint64_t c : corners) {
      signature = mixed(signature * 0x9e3779b97f4a7c15U + c);
    }
    return signature | 1;  // that of joined edges is 0
  }

  void emit_all(Spool<std::uint64_t>& polygons) {
    std::vector<PolygonCutter::Triangle> batch;
    for_each_polygon(polygons, [&](std::uint64_t number, Corners p) {
      std::size_t apex = 0;
      if (!decisions_.done() && decisions_.front().polygon == number) {
        apex = decisions_.front().apex;
        decisions_.pop();
      }
      if (apex == kDropped) {
        counts_.duplicates += p.size() - 2;
        return;
      }
      counts_.turned += apex > 0 ? 1 : 0;
      for (std::size_t k = 1; k + 1 < p.size(); ++k) {
        batch.push_back({p[apex], p[(apex + k) % p.size()], p[(apex + k + 1) % p.size()]});
      }
      if (batch.size() >= kBatch) {
        emit_(batch);
        batch.clear();
      }
    });
    polygons.erase();
    if (!batch.empty()) {
      emit_(batch);
    }
  }

  Store& store_;
  const PolygonCutter::TriangleSource& triangles_;
  const PolygonCutter::Emit& emit_;
  std::size_t memory_;
  EdgeFilter wanted_;
  EdgeFilter disputed_;
  std::vector<Spool<Claim>> joined_;  // edges of the scan, then what each round joins
  ExternalSort<Decision, PolygonOf> decisions_;
  PolygonCutter::Counts counts_;
};

}  // namespace

PolygonCutter::PolygonCutter(Store& store, std::size_t spool_block_bytes)
    : store_(store), spool_(store, "ingest/raw_polygon", spool_block_bytes) {}

void PolygonCutter::add(std::span<const std::uint32_t> sizes,
                        std::span<const std::uint64_t> corners) {
  std::size_t begin = 0;
  for (const std::uint32_t size : sizes) {
    spool_.push(++polygons_);
    spool_.push(size);
    spool_.append(corners.subspan(begin, size));
    begin += size;
    diagonals_ += apexes_of(size) * (size - 3);
  }
}

PolygonCutter::Counts PolygonCutter::cut(const TriangleSource& triangles, const Emit& emit,
                                         std::uint64_t memory_bytes) {
  spool_.finish();
  polygons_ = 0;
  return Cutting(store_, triangles, emit, diagonals_, memory_bytes).run(spool_);
}

}  // namespace rattan

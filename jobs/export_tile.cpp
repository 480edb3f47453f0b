// SPDX-License-Identifier: MIT
#include "jobs/export_tile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/core/exact_math.h"
#include "engine/field/curvature.h"
#include "engine/field/tangent_frame.h"
#include "engine/layout/chart_fields.h"
#include "engine/mesh/scan_record.h"
#include "engine/mesh/wanted_direction.h"
#include "engine/param/parameterize.h"
#include "engine/param/periodic_energy.h"

namespace rattan {

namespace {

constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
constexpr double kPeriod = 2.0 * exact::kPi;

/// Edges of owned triangles whose ends are both in the halo: their weights, and whether they lie on
/// the scan's boundary, are known to another tile.
struct FarEdge {
  std::uint64_t lo = 0;  ///< global
  std::uint64_t hi = 0;
  std::uint32_t triangle = 0;  ///< whose side 1 it is
  float weight = 0.0F;
  bool boundary = false;
};

/// What a tile's rows say about an edge from an owned vertex.
struct RowEdge {
  float weight = 0.0F;
  bool boundary = false;
};

struct Rows {
  FanView fans;
  ChunkView<float> weight;

  void load(Store& store, TileId tile) {
    fans.load(store, tile);
    weight = read(store, fields::kEdgeWeight, tile);
  }
  RowEdge edge(std::uint32_t owned, std::uint32_t other) const {
    const std::span<const std::uint32_t> row = fans.row_begin.span();
    const std::uint32_t at = find_neighbor(fans.neighbor.span(), row[owned], other);
    const bool end = at == row[owned] || at + 1 == row[owned + 1];
    return {weight[at], end && (fans.flags[owned] & kOnBoundary) != 0};
  }
};

}  // namespace

WorkContents WorkContents::of(Store& store) {
  WorkContents work;
  work.scan = load_scan_mesh(store);
  const auto has = [&](std::string_view name) { return store.has_chunk(name, kBoardTile); };
  const TileId last(std::max(work.scan.layout.tile_count(), 1U) - 1);
  work.geometry = has(fields::kSmoothPosition.name) && has(fields::kNormal.name) &&
                  has(fields::kCurvature.name) && store.has_chunk(fields::kDiagonal.name, last);
  work.wanted = has_wanted_directions(store);
  work.colours = work.scan.has_colours && store.has_chunk(fields::kColour.name, last);
  if (!work.geometry) {
    return work;
  }
  work.features = saved_features(store);
  work.field = find_record<FieldRecord>(store, fields::kFieldRecord);
  if (work.field && has(fields::kFrame.name)) {
    work.phase = find_record<PhaseRecord>(store, fields::kPhaseRecord);
    work.norms = work.phase && store.has_chunk(fields::kPhaseNorms.name, last);
  }
  work.charts = store.has_chunk(fields::kTriangleChart.name, last);
  return work;
}

/// Their numbers in the file; kAbsent for those that there are no data for.
struct TileExporter::Arrays {
  std::size_t boundary = kAbsent, colour = kAbsent, feature = kAbsent;
  std::size_t smooth_position = kAbsent, normal = kAbsent;
  std::size_t tensor = kAbsent, k1 = kAbsent, k2 = kAbsent, direction = kAbsent;
  std::size_t fidelity = kAbsent, wanted = kAbsent, wanted_fidelity = kAbsent;
  std::size_t k = kAbsent, k_perp = kAbsent, scale = kAbsent, pins = kAbsent;
  std::size_t theta = kAbsent, phi = kAbsent, norms = kAbsent, pin_energy = kAbsent;
  std::size_t singular_vertex = kAbsent, singular_edges = kAbsent;
  std::size_t tile = kAbsent, energy = kAbsent, kind = kAbsent;
  std::size_t corner_theta = kAbsent, corner_phi = kAbsent, chart = kAbsent;
};

class TileExporter::Task final : public TileTask {
 public:
  Task(TileExporter& exporter, TileId id)
      : e_(exporter), work_(exporter.work_), a_(*exporter.arrays_), id_(id) {}

  void load() override {
    Store& store = e_.store_;
    mesh_ = load_tile(store, work_.scan, id_);
    flags_ = read(store, fields::kVertexFlag, id_);
    if (work_.colours) {
      colours_ = read(store, fields::kColour, id_);
    }
    if (work_.wanted) {
      wanted_ = read(store, fields::kWantedDirection, id_);
    }
    if (work_.geometry) {
      smooth_ = read(store, fields::kSmoothPosition, id_);
      normals_ = read(store, fields::kNormal, id_);
      curvature_ = read(store, fields::kCurvature, id_);
    }
    if (work_.field) {
      frames_.load(store, fields::kFrame, fields::kMeshHalo, id_);
    }
    if (work_.phase) {
      phases_.load(store, fields::kPhase, fields::kMeshHalo, id_);
      diagonal_ = read(store, fields::kDiagonal, id_);
      rows_.load(store, id_);
      load_far_edges();
    }
    if (work_.norms) {
      norms_ = read(store, fields::kPhaseNorms, id_);
    }
    if (work_.charts) {
      charts_ = read(store, fields::kTriangleChart, id_);
    }
  }

  void compute() override {
    const std::uint32_t owned = mesh_.extent.owned;
    positions_.resize(owned);
    for (std::uint32_t v = 0; v < owned; ++v) {
      positions_[v] = in_file(mesh_.positions[v]);
    }
    corners_.resize(mesh_.counts.owned);
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        corners_[t][c] = static_cast<std::int64_t>(mesh_.global_id(mesh_.triangles[t][c]));
      }
    }
    compute_scan();
    if (work_.geometry) {
      compute_geometry();
    }
    if (work_.field) {
      compute_field();
    }
    if (work_.phase) {
      compute_phases();
    }
  }

  void commit() override {
    VtkHdfWriter& file = e_.file_;
    const std::uint64_t first_vertex = mesh_.extent.first;
    const std::uint64_t first_triangle = mesh_.counts.first;
    file.write_points(first_vertex, positions_);
    file.write_triangles(first_triangle, corners_);
    for (const Column& c : point_columns_) {
      file.write(c.array, first_vertex, c.bytes);
    }
    for (const Column& c : cell_columns_) {
      file.write(c.array, first_triangle, c.bytes);
    }
    e_.sums_.singularities += sums_.singularities;
    e_.sums_.edge_energy += sums_.edge_energy;
    e_.sums_.pin_energy += sums_.pin_energy;
  }

 private:
  struct Column {
    std::size_t array;
    std::vector<std::byte> bytes;
  };

  /// Room for the array's rows in the file's type; every row has `width` numbers.
  template <class T>
  static std::span<T> column(std::vector<Column>& columns, std::size_t array, std::size_t rows,
                             std::size_t width) {
    Column& c = columns.emplace_back(Column{array, {}});
    c.bytes.resize(rows * width * sizeof(T));
    return {reinterpret_cast<T*>(c.bytes.data()), rows * width};
  }
  template <class T>
  std::span<T> points(std::size_t array, std::size_t width = 1) {
    return column<T>(point_columns_, array, mesh_.extent.owned, width);
  }
  template <class T>
  std::span<T> cells(std::size_t array, std::size_t width = 1) {
    return column<T>(cell_columns_, array, mesh_.counts.owned, width);
  }
  template <class T, class V>
  static void put(std::span<T> rows, std::size_t row, const V& v) {
    for (std::size_t c = 0; c < 3; ++c) {
      rows[3 * row + c] = static_cast<T>(v[static_cast<Eigen::Index>(c)]);
    }
  }
  Vec3d in_file(const Vec3f& stored) const {
    return stored.cast<double>() * work_.scan.unit + work_.scan.origin;
  }

  void compute_scan() {
    const std::uint32_t owned = mesh_.extent.owned;
    const auto boundary = points<std::uint8_t>(a_.boundary);
    for (std::uint32_t v = 0; v < owned; ++v) {
      boundary[v] = (flags_[v] & kOnBoundary) != 0 ? 1 : 0;
    }
    const auto tile = cells<std::int32_t>(a_.tile);
    std::fill(tile.begin(), tile.end(), static_cast<std::int32_t>(id_.value));
    if (work_.colours) {
      const auto colour = points<std::uint8_t>(a_.colour, 4);
      for (std::uint32_t v = 0; v < owned; ++v) {
        std::copy_n(colours_[v].begin(), 4, colour.begin() + 4 * v);
      }
    }
    if (work_.wanted) {
      const auto wanted = points<float>(a_.wanted, 3);
      const auto fidelity = points<float>(a_.wanted_fidelity);
      for (std::uint32_t v = 0; v < owned; ++v) {
        put(wanted, v, wanted_[v].direction);
        fidelity[v] = wanted_[v].direction.isZero(0.0F) ? 0.0F : wanted_[v].fidelity;
      }
    }
    if (work_.charts) {
      // kNoChart becomes -1.
      const auto chart = cells<std::int32_t>(a_.chart);
      for (std::size_t t = 0; t < chart.size(); ++t) {
        chart[t] = static_cast<std::int32_t>(charts_[t]);
      }
    }
  }

  void compute_geometry() {
    const std::uint32_t owned = mesh_.extent.owned;
    const double per_length = 1.0 / work_.scan.unit;
    const double floor = work_.field ? work_.field->floor_curvature : flat_curvature(work_.scan);
    const auto smooth = points<double>(a_.smooth_position, 3);
    const auto normal = points<float>(a_.normal, 3);
    const auto tensor = points<float>(a_.tensor, 6);
    const auto k1 = points<float>(a_.k1);
    const auto k2 = points<float>(a_.k2);
    const auto direction = points<float>(a_.direction, 3);
    const auto fidelity = points<float>(a_.fidelity);
    // Of the measure's xx yy zz xy xz yz, in VTK's order.
    constexpr std::array<std::size_t, 6> kOrder{0, 1, 2, 3, 5, 4};
    for (std::uint32_t v = 0; v < owned; ++v) {
      put(smooth, v, in_file(smooth_[v]));
      put(normal, v, normals_[v]);
      const CurvatureMeasure& m = curvature_[v];
      const double area = m.m[6];
      for (std::size_t c = 0; c < 6; ++c) {
        const double value = area > 0.0 ? m.m[kOrder[c]] / area * per_length : 0.0;
        tensor[6 * v + c] = static_cast<float>(value);
      }
      const TangentFrame f = tangent_frame(normals_[v].cast<double>());
      const PrincipalDirections p = principal_directions(m, f.x, f.y, floor);
      k1[v] = static_cast<float>(p.k1 * per_length);
      k2[v] = static_cast<float>(p.k2 * per_length);
      fidelity[v] = static_cast<float>(p.fidelity);
      Vec3d k = Vec3d::Zero();
      if (p.fidelity > 0.0) {
        const Complexd z = symmetry_root(unit_or(p.doubled, Complexd(1.0, 0.0)), 2);
        k = z.real() * f.x + z.imag() * f.y;
      }
      put(direction, v, k);
    }
    const auto feature = points<std::uint8_t>(a_.feature);
    for (const FeatureMark& mark :
         work_.features.of_tile(mesh_.extent, mesh_.halo_ids.span()).marks) {
      feature[mark.vertex] = mark.corner ? 2 : 1;
    }
  }

  void compute_field() {
    const auto k = points<float>(a_.k, 3);
    const auto k_perp = points<float>(a_.k_perp, 3);
    const auto scale = points<float>(a_.scale);
    const auto pins = points<std::uint8_t>(a_.pins);
    for (std::uint32_t v = 0; v < mesh_.extent.owned; ++v) {
      const VertexFrame& f = frames_.owned[v];
      put(k, v, f.direction);
      put(k_perp, v, Vec3d(f.normal.cast<double>().cross(f.direction.cast<double>())));
      scale[v] = f.scale;
      pins[v] = static_cast<std::uint8_t>(f.pins);
    }
  }

  void compute_phases() {
    const std::vector<VertexFrame> frames = frames_.gather();
    const std::vector<PairValue> phases = phases_.gather();
    const TileCoordinates coordinates = tile_coordinates(mesh_, frames, phases, work_.phase->omega);
    TileSingularities singular;
    sums_.singularities = count_singularities(mesh_, coordinates, &singular);
    const std::uint32_t owned = mesh_.extent.owned;
    const auto theta = points<double>(a_.theta);
    const auto phi = points<double>(a_.phi);
    const auto pin_energy = points<double>(a_.pin_energy);
    for (std::uint32_t v = 0; v < owned; ++v) {
      theta[v] = coordinates.angles[v].theta;
      phi[v] = coordinates.angles[v].phi;
      pin_energy[v] =
          rattan::pin_energy(frames[v].pins, work_.phase->density, diagonal_[v], phases[v]);
      sums_.pin_energy += pin_energy[v];
    }
    std::copy_n(singular.vertices.begin(), owned, points<std::uint8_t>(a_.singular_vertex).begin());
    std::copy_n(singular.edges_at_vertex.begin(), owned,
                points<std::uint8_t>(a_.singular_edges).begin());
    if (work_.norms) {
      const auto norms = points<float>(a_.norms, 2);
      for (std::uint32_t v = 0; v < owned; ++v) {
        norms[2 * v] = norms_[v][0];
        norms[2 * v + 1] = norms_[v][1];
      }
    }
    const auto kind = cells<std::uint8_t>(a_.kind);
    for (std::size_t t = 0; t < kind.size(); ++t) {
      kind[t] = static_cast<std::uint8_t>(singular.triangles[t]);
    }
    compute_corners(coordinates, singular);
    compute_energies(frames, phases, coordinates);
  }

  /// theta and phi at the corners of each triangle in the gauge of the first; zeros where they
  /// don't close.
  void compute_corners(const TileCoordinates& coordinates, const TileSingularities& singular) {
    const auto theta = cells<float>(a_.corner_theta, 3);
    const auto phi = cells<float>(a_.corner_phi, 3);
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      const TriangleKind kind = singular.triangles[t];
      if (kind == TriangleKind::kField || kind == TriangleKind::kPhase) {
        continue;
      }
      EdgeTransport to_first;
      for (std::uint32_t c = 0; c < 3; ++c) {
        PhaseAngles at = coordinates.angles[mesh_.triangles[t][c]];
        quarter_turns(to_first.r, at.theta, at.phi);
        theta[3 * t + c] = static_cast<float>(at.theta + kPeriod * to_first.s);
        phi[3 * t + c] = static_cast<float>(at.phi + kPeriod * to_first.t);
        to_first = compose(to_first, coordinates.side_transport(3 * t + c));
      }
    }
  }

  /// F* (PGP Eq. 15, with the solver's weights) of each triangle: half of w |X_i - T X_j|^2 of its
  /// sides, all of it on the boundary.
  void compute_energies(const std::vector<VertexFrame>& frames,
                        const std::vector<PairValue>& phases, const TileCoordinates& coordinates) {
    const auto energy = cells<double>(a_.energy);
    auto far = far_edges_.begin();
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        const TileEdge& e = coordinates.edges[coordinates.side_edge[3 * t + c]];
        RowEdge row;
        if (e.lo < mesh_.extent.owned) {
          row = rows_.edge(e.lo, e.hi);
        } else if (e.hi < mesh_.extent.owned) {
          row = rows_.edge(e.hi, e.lo);
        } else {
          ensure(far != far_edges_.end() && far->triangle == t, "far edges are known");
          row = {far->weight, far->boundary};
          ++far;
        }
        energy[t] += (row.boundary ? 1.0 : 0.5) * static_cast<double>(row.weight) *
                     misfit(frames[e.lo], frames[e.hi], phases[e.lo], phases[e.hi]);
      }
      sums_.edge_energy += energy[t];
    }
  }

  /// |X_i - T_ij X_j|^2, i the lower global id.
  double misfit(const VertexFrame& i, const VertexFrame& j, const PairValue& xi,
                const PairValue& xj) const {
    const EdgeGauge g = edge_gauge(i, j, work_.phase->omega);
    const PairValue turned = quarter_turn(xj, g.r);
    const auto part = [](const Complex& a, const Complex& b, double delta) {
      const exact::SinCos s = exact::sincos(delta);
      const double re = b.real() * s.cos + b.imag() * s.sin - a.real();
      const double im = b.imag() * s.cos - b.real() * s.sin - a.imag();
      return re * re + im * im;
    };
    return part(xi.u, turned.u, g.delta) + part(xi.v, turned.v, g.delta_perp);
  }

  /// One other tile's rows at a time; the cache makes up for their coming again.
  void load_far_edges() {
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      const LocalTriangle& c = mesh_.triangles[t];
      if (c[1] >= mesh_.extent.owned && c[2] >= mesh_.extent.owned) {
        const std::uint64_t a = mesh_.global_id(c[1]);
        const std::uint64_t b = mesh_.global_id(c[2]);
        far_edges_.push_back({std::min(a, b), std::max(a, b), t, 0.0F, false});
      }
    }
    std::sort(far_edges_.begin(), far_edges_.end(), [](const FarEdge& a, const FarEdge& b) {
      return a.lo != b.lo ? a.lo < b.lo : a.hi < b.hi;
    });
    for (std::size_t at = 0; at < far_edges_.size();) {
      const TileId owner = work_.scan.layout.owner(far_edges_[at].lo);
      const TileExtent& extent = work_.scan.layout.tiles[owner.value];
      Rows rows;
      rows.load(e_.store_, owner);
      const auto halo = read(e_.store_, fields::kMeshHalo.halo_ids, owner);
      for (; at < far_edges_.size() && far_edges_[at].lo < extent.first + extent.owned; ++at) {
        FarEdge& e = far_edges_[at];
        const std::uint64_t hi = e.hi - extent.first;
        const auto local =
            hi < extent.owned
                ? static_cast<std::uint32_t>(hi)
                : extent.owned +
                      static_cast<std::uint32_t>(std::lower_bound(halo.begin(), halo.end(), e.hi) -
                                                 halo.begin());
        const RowEdge edge = rows.edge(static_cast<std::uint32_t>(e.lo - extent.first), local);
        e.weight = edge.weight;
        e.boundary = edge.boundary;
      }
    }
    std::sort(far_edges_.begin(), far_edges_.end(),
              [](const FarEdge& a, const FarEdge& b) { return a.triangle < b.triangle; });
  }

  TileExporter& e_;
  const WorkContents& work_;
  const Arrays& a_;
  TileId id_;

  TileMesh mesh_;
  ChunkView<std::uint8_t> flags_;
  ChunkView<Rgba> colours_;
  ChunkView<VertexDirection> wanted_;
  ChunkView<Vec3f> smooth_, normals_;
  ChunkView<CurvatureMeasure> curvature_;
  HaloView<VertexFrame> frames_;
  HaloView<PairValue> phases_;
  ChunkView<float> diagonal_;
  ChunkView<PartNorms> norms_;
  ChunkView<std::uint32_t> charts_;
  Rows rows_;
  std::vector<FarEdge> far_edges_;  ///< by triangle

  std::vector<Vec3d> positions_;
  std::vector<std::array<std::int64_t, 3>> corners_;
  std::vector<Column> point_columns_;
  std::vector<Column> cell_columns_;
  ExportSums sums_;
};

TileExporter::TileExporter(Store& store, const WorkContents& work, VtkHdfWriter& file)
    : store_(store), work_(work), file_(file) {
  using enum ArrayType;
  Arrays a;
  const auto point = [&](const char* name, ArrayType type, int components = 1) {
    return file.add_array(VtkHdfWriter::Place::kPoint, {name, type, components});
  };
  const auto cell = [&](const char* name, ArrayType type, int components = 1) {
    return file.add_array(VtkHdfWriter::Place::kCell, {name, type, components});
  };
  a.boundary = point("boundary", kUint8);
  a.tile = cell("tile", kInt32);
  if (work.colours) {
    a.colour = point("colour", kUint8, 4);
  }
  if (work.wanted) {
    a.wanted = point("wanted_direction", kFloat, 3);
    a.wanted_fidelity = point("wanted_fidelity", kFloat);
  }
  if (work.geometry) {
    a.smooth_position = point("low_passed_position", kDouble, 3);
    a.normal = point("normal", kFloat, 3);
    a.tensor = point("curvature_tensor", kFloat, 6);
    a.k1 = point("curvature_1", kFloat);
    a.k2 = point("curvature_2", kFloat);
    a.direction = point("curvature_direction_1", kFloat, 3);
    a.fidelity = point("curvature_fidelity", kFloat);
    a.feature = point("feature", kUint8);
  }
  if (work.field) {
    a.k = point("K", kFloat, 3);
    a.k_perp = point("K_perp", kFloat, 3);
    a.scale = point("curl_scale", kFloat);
    a.pins = point("pins", kUint8);
  }
  if (work.phase) {
    a.theta = point("theta", kDouble);
    a.phi = point("phi", kDouble);
    a.pin_energy = point("pin_energy", kDouble);
    a.singular_vertex = point("singular_vertex", kUint8);
    a.singular_edges = point("singular_edges", kUint8);
    a.energy = cell("energy", kDouble);
    a.kind = cell("singularity", kUint8);
    a.corner_theta = cell("corner_theta", kFloat, 3);
    a.corner_phi = cell("corner_phi", kFloat, 3);
  }
  if (work.norms) {
    a.norms = point("norms", kFloat, 2);
  }
  if (work.charts) {
    a.chart = cell("chart", kInt32);
  }
  arrays_ = std::make_unique<const Arrays>(a);
}

TileExporter::~TileExporter() = default;

std::unique_ptr<TileTask> TileExporter::task(TileId id) {
  return std::make_unique<Task>(*this, id);
}

}  // namespace rattan

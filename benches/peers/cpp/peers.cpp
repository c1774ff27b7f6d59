// Peers in C++, from Debian packages: OpenMesh (half-edge collapse, quadrics) and CGAL (Garland-Heckbert collapse, AABB
// tree). `peers_cpp STAGE MODEL...` prints a JSON line per measurement; ../README.md tells the environment variables
// and the files.
#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/version.h>
#define _USE_MATH_DEFINES
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/config.h>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

using K = CGAL::Simple_cartesian<double>;
using Surface = CGAL::Surface_mesh<K::Point_3>;
using OpenSurface = OpenMesh::TriMesh_ArrayKernelT<>;
namespace SMS = CGAL::Surface_mesh_simplification;
using std::string;
using std::vector;

const int TARGET = 200;      // faces
const double LONG = 5;       // seconds; a run this long needs no warm-up before it
const double ENOUGH = 20;    // seconds; no further run starts after so many

string env(const char* name, const char* otherwise) { const char* v = getenv(name); return v ? v : otherwise; }

double cpu() { timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }

double peak_mb() {
    std::ifstream in("/proc/self/status");
    for (string line; std::getline(in, line);)
        if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024;
    return 0;
}

double median(vector<double> a) {
    std::sort(a.begin(), a.end());
    size_t m = a.size() / 2;
    return a.size() % 2 ? a[m] : (a[m - 1] + a[m]) / 2;
}

// `while (t.next()) { ...; { Timer::Part part(t); work(); } }`: a run to warm up, then $REPEATS; a Part is timed.
struct Timer {
    int repeats = std::stoi(env("REPEATS", "3"));
    vector<double> wall, used;
    double extra_mb = -1;
    bool warm = false;

    bool next() {
        if (wall.empty() && !warm) return true;
        if (!warm) {
            warm = true;
            if (wall[0] < LONG) wall.clear(), used.clear();
        }
        return int(wall.size()) < repeats && std::accumulate(wall.begin(), wall.end(), 0.0) < ENOUGH;
    }

    struct Part {
        Timer& t;
        double peak = 0, c;
        std::chrono::steady_clock::time_point w;
        explicit Part(Timer& t) : t(t) {
            if (t.extra_mb < 0) {
                std::ofstream("/proc/self/clear_refs") << "5";  // the high-water mark falls to what is in use now
                peak = peak_mb();
            }
            c = cpu();
            w = std::chrono::steady_clock::now();
        }
        ~Part() {
            t.wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - w).count());
            t.used.push_back(cpu() - c);
            if (t.extra_mb < 0) t.extra_mb = peak_mb() - peak;  // the first run: later ones reuse memory
        }
    };
};

string lower(string s) { for (char& c : s) c = char(tolower(c)); return s; }

bool wanted(const string& peer) {
    std::stringstream only(lower(env("PEERS_ONLY", "")));
    bool any = false;
    for (string part; std::getline(only, part, ',');) {
        part.erase(0, part.find_first_not_of(' ')), part.erase(part.find_last_not_of(' ') + 1);
        if (part.empty()) continue;
        any = true;
        if (lower(peer).find(part) != string::npos) return true;
    }
    return !any;
}

string error(string why) {
    for (char& c : why) if (c == '"' || c == '\\' || c < ' ') c = ' ';
    return "\"error\": \"" + why.substr(0, 160) + "\"";
}

// Prints the row of one peer. `body(timer)` runs in a process of its own, so that a crash, a hang and the memory are
// its alone; it returns how good the answer is, as the inside of a JSON object.
void measure(const char* stage, const string& model, const char* peer, const string& version,
             const std::function<string(Timer&)>& body) {
    if (!wanted(peer)) return;
    int ends[2], limit = std::stoi(env("PEER_TIMEOUT", "300"));
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    pid_t pid = fork();
    if (pid == 0) {
        close(ends[0]);
        dup2(open("/dev/null", O_WRONLY), 1);  // stdout is for rows
        alarm(limit);
        string out;
        try {
            Timer t;
            string acc = body(t);
            char figures[256];
            snprintf(figures, sizeof figures, "\"median\": %.9g, \"best\": %.9g, \"cpu\": %.9g, \"runs\": %zu, \"extra_mb\": %.1f",
                     median(t.wall), *std::min_element(t.wall.begin(), t.wall.end()), median(t.used), t.wall.size(), t.extra_mb);
            out = figures + (", \"acc\": {" + acc + "}");
        } catch (const std::exception& e) {
            out = error(e.what());
        }
        if (write(ends[1], out.data(), out.size()) < 0) _exit(1);
        _exit(0);
    }
    close(ends[1]);
    string out;
    char buffer[4096];
    for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;) out.append(buffer, size_t(n));
    close(ends[0]);
    int status = 0;
    waitpid(pid, &status, 0);
    if (out.empty()) {
        int killer = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
        out = error(killer == SIGALRM ? "over " + std::to_string(limit) + " s" : killer ? "killed by signal " + std::to_string(killer) : "died");
    }
    printf("{\"stage\": \"%s\", \"model\": \"%s\", \"peer\": \"%s\", \"version\": \"%s\", %s}\n", stage, model.c_str(), peer, version.c_str(), out.c_str());
    fflush(stdout);
}

template <class T> vector<T> array(const string& name) {
    std::ifstream in(env("CASES", "cases") + "/" + name, std::ios::binary | std::ios::ate);
    if (!in) throw std::runtime_error(name + " is missing");
    vector<T> a(size_t(in.tellg()) / sizeof(T));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(a.data()), std::streamsize(a.size() * sizeof(T)));
    return a;
}

// Leaves a simplified mesh in $PEERS_TMP, for the caller to score.
string keep(const string& tag, const vector<double>& v, const vector<uint32_t>& f) {
    string base = env("PEERS_TMP", "/tmp") + "/" + tag;
    std::ofstream(base + ".v.f64", std::ios::binary).write(reinterpret_cast<const char*>(v.data()), std::streamsize(v.size() * 8));
    std::ofstream(base + ".f.u32", std::ios::binary).write(reinterpret_cast<const char*>(f.data()), std::streamsize(f.size() * 4));
    return "\"score\": \"" + tag + "\"";
}

struct Mesh {
    vector<double> v;
    vector<uint32_t> f;

    Surface cgal() const {
        Surface m;
        for (size_t i = 0; i < v.size(); i += 3) m.add_vertex({v[i], v[i + 1], v[i + 2]});
        for (size_t i = 0; i < f.size(); i += 3) m.add_face(Surface::Vertex_index(f[i]), Surface::Vertex_index(f[i + 1]), Surface::Vertex_index(f[i + 2]));
        return m;
    }

    OpenSurface openmesh() const {
        OpenSurface m;
        for (size_t i = 0; i < v.size(); i += 3) m.add_vertex(OpenSurface::Point(float(v[i]), float(v[i + 1]), float(v[i + 2])));
        for (size_t i = 0; i < f.size(); i += 3) m.add_face(OpenMesh::VertexHandle(int(f[i])), OpenMesh::VertexHandle(int(f[i + 1])), OpenMesh::VertexHandle(int(f[i + 2])));
        m.request_face_normals();
        m.update_face_normals();
        return m;
    }
};

void simplify(const string& model, const Mesh& mesh) {
    const char* stage = "a simplify to 200 faces";
    string openmesh = std::to_string(OM_GET_VER) + "." + std::to_string(OM_GET_MAJ >> 4);
    measure(stage, model, "OpenMesh ModQuadric (half-edge)", openmesh, [&](Timer& t) {
        OpenSurface m;
        while (t.next()) {
            m = mesh.openmesh();
            Timer::Part part(t);
            OpenMesh::Decimater::DecimaterT<OpenSurface> decimater(m);
            OpenMesh::Decimater::ModQuadricT<OpenSurface>::Handle quadrics;
            decimater.add(quadrics);
            decimater.module(quadrics).unset_max_err();
            decimater.initialize();
            decimater.decimate_to_faces(0, TARGET);
            m.garbage_collection();
        }
        vector<double> v;
        vector<uint32_t> f;
        for (auto h : m.vertices()) for (int k = 0; k < 3; k++) v.push_back(m.point(h)[k]);
        for (auto h : m.faces()) for (auto p : m.fv_range(h)) f.push_back(uint32_t(p.idx()));
        return keep(model + ".openmesh", v, f);
    });
    measure(stage, model, "CGAL Garland-Heckbert", CGAL_VERSION_STR, [&](Timer& t) {
        Surface m;
        while (t.next()) {
            m = mesh.cgal();
            Timer::Part part(t);
            SMS::GarlandHeckbert_policies<Surface, K> policies(m);
            SMS::Count_stop_predicate<Surface> stop(TARGET * 3 / 2);  // counts edges
            SMS::edge_collapse(m, stop, CGAL::parameters::get_cost(policies.get_cost()).get_placement(policies.get_placement()));
            m.collect_garbage();
        }
        vector<double> v;
        vector<uint32_t> f;
        for (auto h : m.vertices()) for (int k = 0; k < 3; k++) v.push_back(m.point(h)[k]);
        for (auto h : m.faces()) for (auto p : m.vertices_around_face(m.halfedge(h))) f.push_back(uint32_t(p));
        return keep(model + ".cgal", v, f);
    });
}

void closest(const string& model, const Mesh& mesh) {
    using Primitive = CGAL::AABB_face_graph_triangle_primitive<Surface>;
    using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, Primitive>>;
    const char* peer = "CGAL AABB_tree, 1 thread";
    auto build = [](Tree& tree, const Surface& m) {
        tree.insert(faces(m).first, faces(m).second, m);
        tree.build();
        tree.accelerate_distance_queries();
    };
    measure("b build", model, peer, CGAL_VERSION_STR, [&](Timer& t) {
        Surface m = mesh.cgal();
        while (t.next()) {
            Tree tree;
            Timer::Part part(t);
            build(tree, m);
        }
        return string();
    });
    measure("b query", model, peer, CGAL_VERSION_STR, [&](Timer& t) {
        auto q = array<double>(model + ".q.f64");
        Surface m = mesh.cgal();
        Tree tree;
        build(tree, m);
        vector<K::Point_3> found(q.size() / 3);
        while (t.next()) {
            Timer::Part part(t);
            for (size_t i = 0; i < found.size(); i++) found[i] = tree.closest_point(K::Point_3(q[3 * i], q[3 * i + 1], q[3 * i + 2]));
        }
        double squares = 0;
        for (size_t i = 0; i < found.size(); i++) squares += CGAL::squared_distance(found[i], K::Point_3(q[3 * i], q[3 * i + 1], q[3 * i + 2]));
        char acc[96];
        snprintf(acc, sizeof acc, "\"rms_distance\": %.17g, \"queries\": %zu", std::sqrt(squares / double(found.size())), found.size());
        return string(acc);
    });
}

int main(int argc, char** argv) try {
    string stage = argc > 1 ? argv[1] : "";
    if (stage != "a" && stage != "b") throw std::runtime_error("usage: peers_cpp a|b MODEL...");
    for (int i = 2; i < argc; i++) {
        string model = argv[i];
        Mesh mesh{array<double>(model + ".v.f64"), array<uint32_t>(model + ".f.u32")};
        stage == "a" ? simplify(model, mesh) : closest(model, mesh);
    }
} catch (const std::exception& e) {
    fprintf(stderr, "%s\n", e.what());
    return 1;
}

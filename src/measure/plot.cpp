#include "measure/plot.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "error.hpp"
#include "frame/pending_file.hpp"
#include "measure/plot_script.hpp"

namespace brume {
namespace {

// A number that gnuplot reads whatever the locale.
std::string number(double x) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.9g", x);
    return buffer;
}

// Not through a shell: a path may hold anything.
int runGnuplot(const std::string& script) {
    const pid_t child = fork();
    if (child < 0) return 127;
    if (child == 0) {
        // What it says is of a script that nobody wrote by hand.
        if (!std::getenv("BRUME_KEEP_PLOTS"))
            if (const int null = open("/dev/null", O_WRONLY); null >= 0) dup2(null, STDERR_FILENO);
        execlp("gnuplot", "gnuplot", script.c_str(), nullptr);
        _exit(127);
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

/// `scriptFor` is given the name that the picture is drawn to.
void draw(const std::string& output, const std::function<std::string(const std::string&)>& scriptFor) {
    PendingFile picture(output);
    std::string file = (std::filesystem::temp_directory_path() / "brume-plot-XXXXXX").string();
    const int handle = mkstemp(file.data());
    if (handle < 0) failIo(file, ": cannot be written; set TMPDIR to a folder that can");
    ::close(handle);
    std::ofstream(file) << scriptFor(picture.path());
    const int status = runGnuplot(file);
    if (const char* keep = std::getenv("BRUME_KEEP_PLOTS"); !keep) std::filesystem::remove(file);
    if (status == 127) failIo("gnuplot cannot be started; install the package gnuplot-nox");
    std::error_code none;
    if (status != 0 || std::filesystem::file_size(picture.path(), none) == 0 || none)
        failIo("gnuplot could not draw '", output, "' (status ", status, ")");
    picture.commit();
}

}  // namespace

void writePlots(const PlotPage& page, const std::string& path) {
    const auto [width, height] = plotSize(page);
    const std::string size = text(width, ",", height), twice = text(2 * width, ",", 2 * height);
    const std::string font = "noenhanced font 'DejaVu Sans,11' rounded";
    draw(path + ".svg", [&](const std::string& to) {
        return plotScript(page, "svg size " + size + " dynamic background rgb 'white' " + font, to);
    });
    // Twice the pixels: sharp on any screen.
    draw(path + ".png", [&](const std::string& to) {
        return plotScript(page, "pngcairo size " + twice + " fontscale 2 linewidth 2 pointscale 2 " + font,
                          to);
    });
}

void writeMap(const cv::Mat& values, double least, double most, const std::string& title,
              const std::string& barLabel, const std::string& path, int width) {
    std::ostringstream out;
    const int height = int(double(width - 110) * values.rows / std::max(1, values.cols)) + 50;
    out << "set encoding utf8\nset terminal pngcairo size " << width << ',' << height
        << " noenhanced font 'DejaVu Sans,10'\nset title " << plotQuoted(title)
        << " offset 0,-.5\nunset key\nunset tics\nset border lc rgb '#888888'\nset lmargin at screen "
        << 10. / width << "\nset rmargin at screen " << 1 - 100. / width << "\nset tmargin at screen "
        << 1 - 32. / height << "\nset bmargin at screen "
        << 18. / height
        // Black over blue and orange to white, lightness rising all the way.
        << "\nset palette defined (0 '#0b0b1e', 1 '#2a2a72', 2 '#4f6fb0', 3 '#9a86a8', 4 '#e08a4a', 5 "
           "'#f8c25c', 6 '#fffbe0')\n"
        << "set logscale cb\nset cbrange [" << number(least) << ':' << number(most)
        << "]\nset format cb '%g'\n"
        << "set cblabel " << plotQuoted(barLabel) << " offset 1,0\nset cbtics font ',9'\n"
        << "set object rectangle from graph 0,0 to graph 1,1 behind fc rgb '#999999' fs solid\n"
        << "set xrange [-.5:" << values.cols - .5 << "]\nset yrange [" << values.rows - .5
        << ":-.5]\n$d << EOD\n";
    for (int j = 0; j < values.rows; j++) {
        for (int i = 0; i < values.cols; i++) {
            const double v = values.at<double>(j, i);
            out << (std::isnan(v) ? "NaN" : number(std::clamp(v, least, most))) << ' ';
        }
        out << '\n';
    }
    out << "EOD\nplot $d matrix with image\n";
    draw(path, [&](const std::string& to) { return "set output " + plotQuoted(to) + "\n" + out.str(); });
}

std::vector<size_t> paretoFrontier(const std::vector<std::pair<double, double>>& points) {
    std::vector<size_t> order;
    for (size_t k = 0; k < points.size(); k++)
        if (std::isfinite(points[k].first) && std::isfinite(points[k].second)) order.push_back(k);
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return points[a] < points[b]; });
    std::vector<size_t> frontier;
    for (size_t k : order)
        if (frontier.empty() || points[k].second < points[frontier.back()].second) frontier.push_back(k);
    return frontier;
}

bool hasGnuplot() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (access((folder + "/gnuplot").c_str(), X_OK) == 0) return true;
    return false;
}

}  // namespace brume

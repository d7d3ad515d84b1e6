// What the window remembers from one time to the next.
#pragma once

#include <opencv2/core/types.hpp>
#include <string>

namespace brume::preview {

struct Settings {
    cv::Size window{1440, 900};
    double sidebar = 410;  ///< px at content scale 1
    bool probe = true, loop = true;
    std::string tab = "Effects";

    /// $XDG_CONFIG_HOME/brume/preview.json, else ~/.config/brume/preview.json; empty where there is neither.
    static std::string path();
    /// Defaults where there is no file, or it cannot be understood.
    static Settings load();
    /// Quietly does nothing where the folder cannot be written.
    void save() const;
};

}  // namespace brume::preview

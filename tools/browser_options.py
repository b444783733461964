"""Options with which Chromium draws WebGL without a graphics card."""

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")

"""What the paper reports, to stand beside ours."""

TABLE_TWO = {
    "pixelnerf": ("pixelNeRF", {"psnr": 29.2, "ssim": 0.973, "lpips": 0.071}),
    "single_encoder": ("one stacked hourglass", {"psnr": 25.1, "ssim": 0.955, "lpips": 0.147}),
    "no_mha": ("no MHA", {"psnr": 29.8, "ssim": 0.976, "lpips": 0.073}),
    "no_mha_depth": ("no MHA, with depth ground truth", {"psnr": 25.6, "ssim": 0.966, "lpips": 0.128}),
    "no_view": ("no view directions in MHA", {"psnr": 28.7, "ssim": 0.974, "lpips": 0.072}),
    "charnerf": ("CharNeRF", {"psnr": 34.3, "ssim": 0.988, "lpips": 0.031}),
}
"""Table II, by the name of our experiment: the paper's name of the row, its metrics."""

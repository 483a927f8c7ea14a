# Installs Chalumeau for the user who runs this: no administrator.
#   powershell -ExecutionPolicy Bypass -File install.ps1
#   powershell -ExecutionPolicy Bypass -File install.ps1 -Uninstall
# Never run on Windows yet.
param([switch]$Uninstall)
$ErrorActionPreference = 'Stop'

# Per-user plugin folders, as CLAP and VST3 define them.
$common = Join-Path $env:LOCALAPPDATA 'Programs\Common'
$programs = Join-Path $env:LOCALAPPDATA 'Programs\Chalumeau'
$menu = Join-Path $env:APPDATA 'Microsoft\Windows\Start Menu\Programs\Chalumeau.lnk'
$places = [ordered]@{
    'Chalumeau.clap'           = Join-Path $common 'CLAP\Chalumeau.clap'
    'Chalumeau.vst3'           = Join-Path $common 'VST3\Chalumeau.vst3'
    'chalumeau.exe'            = Join-Path $programs 'chalumeau.exe'
    'chalumeau-standalone.exe' = Join-Path $programs 'chalumeau-standalone.exe'
}

# What an earlier version left is removed too. Presets and instruments of your own stay.
foreach ($place in @($places.Values) + $menu) {
    if (Test-Path -LiteralPath $place) {
        Remove-Item -LiteralPath $place -Recurse -Force
        Write-Output "removed $place"
    }
}
if ($Uninstall) {
    if ((Test-Path -LiteralPath $programs) -and -not (Get-ChildItem -LiteralPath $programs)) {
        Remove-Item -LiteralPath $programs
        Write-Output "removed the empty folder $programs"
    }
    return
}
foreach ($name in $places.Keys) {
    $place = $places[$name]
    New-Item -ItemType Directory -Force -Path (Split-Path $place) | Out-Null
    Copy-Item -LiteralPath (Join-Path $PSScriptRoot $name) -Destination $place -Recurse
    Write-Output "installed $place"
}
$shortcut = (New-Object -ComObject WScript.Shell).CreateShortcut($menu)
$shortcut.TargetPath = $places['chalumeau-standalone.exe']
$shortcut.Save()
Write-Output "installed $menu"
Write-Output ''
Write-Output 'Let your DAW search for plugins again. Without a DAW: Chalumeau in the Start menu.'

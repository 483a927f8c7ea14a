-- Four notes, each half a second, again and again, for Ardour: a processor that stands before the plugin on its track. Ardour runs
-- it before an export begins, so that an end would be over by then.
ardour { ["type"] = "dsp", name = "Chalumeau notes", category = "Instrument", license = "MIT", author = "Chalumeau" }

function dsp_ioconfig () return { { midi_in = 1, midi_out = 1, audio_in = -1, audio_out = -1 } } end
function dsp_has_midi_input () return true end
function dsp_has_midi_output () return true end

local notes, rate, at = { 58, 62, 65, 70 }, 48000, 0

function dsp_init (r) rate = r end

function dsp_run (_, _, n_samples)
	local out, slot = 1, rate / 2
	for offset = 0, n_samples - 1 do
		local note, within = notes[at // slot % #notes + 1], at % slot
		-- The key is held until a twentieth of a second before the next.
		local status = within == 0 and 0x90 or within == slot - rate // 20 and 0x80
		if status then
			midiout[out] = { time = offset + 1, data = { status, note, 100 } }
			out = out + 1
		end
		at = at + 1
	end
end

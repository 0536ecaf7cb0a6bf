'use strict';
const cues = JSON.parse(document.getElementById('cues').textContent);
const byId = (name) => document.getElementById(name);
let sound = null;
let timers = [];

function beep(startS, hertz, lengthS) {
  const tone = sound.createOscillator();
  const volume = sound.createGain();
  tone.frequency.value = hertz;
  volume.gain.setValueAtTime(0.0001, startS);
  volume.gain.exponentialRampToValueAtTime(0.5, startS + 0.01);
  volume.gain.setValueAtTime(0.5, startS + lengthS - 0.02);
  volume.gain.exponentialRampToValueAtTime(0.0001, startS + lengthS);
  tone.connect(volume).connect(sound.destination);
  tone.start(startS);
  tone.stop(startS + lengthS);
}

function speak(text) {
  if (!text || !('speechSynthesis' in window)) return;
  speechSynthesis.cancel();
  const words = new SpeechSynthesisUtterance(text);
  words.lang = 'en';
  speechSynthesis.speak(words);
}

function show(cue) {
  document.body.className = `running ${cue.kind}`;
  byId('number').textContent = cue.large;
  byId('number').classList.toggle('word', cue.large.length > 2);
  byId('sentence').textContent = cue.sentence;
  byId('progress').value = cue.done;
  speak(cue.spoken);
}

async function start() {
  stop();
  byId('start').textContent = 'Stop';
  sound = sound || new AudioContext();
  await sound.resume();
  if (navigator.wakeLock) navigator.wakeLock.request('screen').catch(() => {});
  const zeroS = sound.currentTime + 3;
  for (const cue of cues) {
    for (const [afterS, hertz, lengthS] of cue.beeps) {
      beep(zeroS + cue.time_s + afterS, hertz, lengthS);
    }
    timers.push(setTimeout(show, (3 + cue.time_s) * 1000, cue));
  }
  document.body.className = 'running';
  byId('number').textContent = '';
  byId('sentence').textContent = 'It starts with three beeps.';
}

function stop() {
  timers.forEach(clearTimeout);
  timers = [];
  if (sound) sound.close();
  sound = null;
  if ('speechSynthesis' in window) speechSynthesis.cancel();
  document.body.className = '';
  byId('start').textContent = 'Start';
  byId('number').textContent = '';
  byId('sentence').textContent = '';
}

byId('start').addEventListener('click', () => (timers.length ? stop() : start()));
document.addEventListener('keydown', (event) => {
  if (event.key === 'Escape') stop();
});

// The page of a meeting, for the person in front of the camera: the picture with numbered things,
// the request, the voice and the keyboard. All that it shows is in `board` (meeting_page.py).

const DETAILS = {
  idle: 'This page shows it as soon as it runs.',
  starting: 'Sit where the camera sees your face and the things.',
  no_person: 'Come into the picture and look at the camera.',
  camera: 'The head looks at your face first.',
  thing: 'Look at it until the answer comes.',
  rearrange: 'Give each thing another place. Then press Done.',
  paused: 'Nothing is measured now.',
};
const SIGNS = {
  starting: 'M6 12h.01M12 12h.01M18 12h.01',
  no_person: 'M9 11a4 4 0 1 0 0-8 4 4 0 0 0 0 8M2 21v-1a6 6 0 0 1 6-6h2a6 6 0 0 1 3 .8M17 15l5 6M22 15l-5 6',
  camera: 'M3 8h4l2-3h6l2 3h4v11H3zM12 17a4 4 0 1 0 0-8 4 4 0 0 0 0 8',
  rearrange: 'M3 8h15M14 4l4 4-4 4M21 16H6M10 12l-4 4 4 4',
  paused: 'M8 5v14M16 5v14',
  right: 'M4 13l5 5L20 6',
  wrong: 'M5 5l14 14M19 5L5 19',
};
const ICONS = {
  pause: 'M8 5v14M16 5v14',
  resume: 'M7 4l12 8-12 8z',
  end: 'M6 6h12v12H6z',
  help: 'M9 9a3 3 0 1 1 4 2.8c-.7.4-1 .9-1 1.7M12 17h.01M12 22a10 10 0 1 0 0-20 10 10 0 0 0 0 20',
  voice: 'M4 9v6h4l5 4V5L8 9zM16 9a4 4 0 0 1 0 6M18.5 6.5a8 8 0 0 1 0 11',
  mute: 'M4 9v6h4l5 4V5L8 9zM16.5 9.5l5 5M21.5 9.5l-5 5',
};
const WORDS = [
  ['The large number', 'The thing to look at. Turn your head and your eyes as you always do; do not point.'],
  ['The picture', 'What the head sees. It is not a mirror: what is on its left is on your right.'],
  ['A number in the picture', 'Each thing keeps its number. At the edge with an arrow: the thing is outside the picture.'],
  ['Right, wrong', 'Whether the head turned to the thing. It goes by your face: the number never reaches it.'],
  ['Learner alone', 'How often the part that learns chose the thing that you looked at, without other help.'],
  ['Guessing', 'How often a blind choice among the things would be right.'],
  ['The voice', 'Press the button Voice to hear each request: then you need not look at this page.'],
];

export default {
  template: `
<main class="mb" :class="['mb-' + board.phase, verdict && 'mb-' + verdict, explains && 'mb-explains']" :data-phase="board.phase"
      @click="release">
  <header class="mb-request" role="status" aria-live="assertive">
    <h1 class="mb-sentence">{{ board.message || '…' }}</h1>
    <p class="mb-detail">{{ detail }}</p>
  </header>

  <section v-if="!explains && board.phase !== 'ended'" class="mb-sign" :title="signTitle">
    <b v-if="showsNumber" class="mb-number" :class="{'mb-long': board.number > 9}">{{ board.number }}</b>
    <template v-else>
      <span class="mb-symbol"><svg viewBox="0 0 24 24" aria-hidden="true"><path :d="sign"/></svg></span>
      <b v-if="verdict" class="mb-verdict">{{ verdict === 'right' ? 'Right' : 'Wrong' }}</b>
    </template>
  </section>

  <section v-show="board.phase !== 'ended'" class="mb-stage">
    <div class="mb-frame" :style="{'--aspect': shown.aspect}" :class="{'mb-old': !board.live}"
         title="What the head sees. It is not a mirror.">
      <div ref="view" class="mb-view"></div>
      <p v-if="!shown.source" class="mb-wait">The picture comes with the first image.</p>
      <span v-for="mark in shown.marks" :key="mark.number" class="mb-mark"
            :class="markClasses(mark)" :style="{left: mark.x * 100 + '%', top: mark.y * 100 + '%'}">
        <b>{{ mark.number }}</b>
        <i v-if="mark.outside" :style="{transform: 'rotate(' + mark.angle_deg + 'deg)'}"></i>
      </span>
      <span class="mb-caption">What the head sees<template v-if="board.film">, from a film</template></span>
    </div>
  </section>

  <aside v-if="!explains && board.phase !== 'ended'" class="mb-figures">
    <div title="How many requests there were, and how many there will be.">
      <h2>Request</h2>
      <p><b>{{ board.trial ?? '–' }}</b><template v-if="board.trials"> of {{ board.trials }}</template></p>
      <div class="mb-progress"><i :style="{width: progress}"></i></div>
    </div>
    <div title="How often the part that learns chose the thing that you looked at, without other help.">
      <h2>Learner alone</h2>
      <p v-if="board.learner"><b>{{ board.learner.successes }}</b> of {{ board.learner.trials }} right</p>
      <p v-else><b>–</b></p>
      <small v-if="board.chance != null">guessing: {{ percent(board.chance) }}</small>
    </div>
    <div v-if="board.right != null && !verdict" title="What the head made of the request before.">
      <h2>Last request</h2>
      <p class="mb-last" :class="board.right ? 'mb-good' : 'mb-bad'">
        <svg viewBox="0 0 24 24" aria-hidden="true"><path :d="board.right ? signs.right : signs.wrong"/></svg>{{ board.right ? 'right' : 'wrong' }}</p>
    </div>
  </aside>

  <section v-if="board.phase === 'ended'" class="mb-result">
    <template v-if="board.learner">
      <p class="mb-lead">The learner alone chose the thing that you looked at</p>
      <p class="mb-total"><b>{{ board.learner.successes }}</b> of {{ board.learner.trials }} times</p>
      <div class="mb-scale" role="img" :aria-label="scaleText">
        <i class="mb-interval" :style="{left: percent(low), width: percent(high - low)}"></i>
        <i class="mb-rate" :style="{left: percent(rate)}"></i>
        <i v-if="board.chance != null" class="mb-chance" :style="{left: percent(board.chance)}"><span>guessing {{ percent(board.chance) }}</span></i>
        <small class="mb-zero">0 %</small><small class="mb-all">100 %</small>
      </div>
      <p>{{ scaleText }}</p>
      <p class="mb-judgement">{{ judgement }}</p>
    </template>
    <p v-else class="mb-lead">There was no trial in which the learner made a choice of its own.</p>
    <p v-if="board.successes != null && board.trial">The head ended at the thing that you looked at {{ board.successes }} of {{ board.trial }} times.</p>
    <p v-if="board.report.path" class="mb-report">
      <a v-if="board.report.address" :href="board.report.address" target="_blank">Open the report</a>
      <small>{{ board.report.path }}</small>
    </p>
  </section>

  <section v-if="help || explains" class="mb-help" aria-label="What is on this page">
    <dl><template v-for="[name, text] in words"><dt>{{ name }}</dt><dd>{{ text }}</dd></template></dl>
    <button v-if="!explains" class="mb-close" @click="toggleHelp">Close</button>
  </section>

  <footer class="mb-controls">
    <button v-if="board.phase === 'rearrange'" class="mb-main" :disabled="!can('moved')" @click="moved"
            title="The things stand at their new places.">Done<kbd>Enter</kbd></button>
    <button v-if="board.phase !== 'ended'" :class="{'mb-main': paused}" :disabled="!can('pause')" @click="togglePause"
            :title="paused ? 'Ask again.' : 'Stop asking for a while.'">
      <svg viewBox="0 0 24 24"><path :d="paused ? icons.resume : icons.pause"/></svg>{{ paused ? 'Go on' : 'Pause' }}<kbd>Space</kbd></button>
    <button class="mb-voice" :class="{'mb-off': !voice}" :aria-pressed="voice" :disabled="!speaks" @click="toggleVoice"
            :title="voiceTitle">
      <svg viewBox="0 0 24 24"><path :d="voice ? icons.voice : icons.mute"/></svg>{{ voiceText }}<kbd>V</kbd></button>
    <button v-if="!explains" :aria-expanded="help" @click="toggleHelp" title="A sentence for each thing on this page.">
      <svg viewBox="0 0 24 24"><path :d="icons.help"/></svg>What is this?<kbd>H</kbd></button>
    <button v-if="board.phase !== 'ended'" :disabled="!can('end')" @click="askToEnd" title="Asks first, then writes the report.">
      <svg viewBox="0 0 24 24"><path :d="icons.end"/></svg>End<kbd>Esc</kbd></button>
    <a href="/view" title="The page for those who know the robot: beliefs, nodes, log.">Full view</a>
  </footer>

  <dialog ref="confirm" class="mb-confirm">
    <h2>End the meeting?</h2>
    <p>The report is written then. A meeting that has ended cannot go on.</p>
    <button class="mb-main" @click="end">End<kbd>Enter</kbd></button>
    <button @click="$refs.confirm.close()">Go on<kbd>Esc</kbd></button>
  </dialog>
</main>`,
  props: { board: Object },
  emits: ['pause', 'end', 'moved'],
  data: () => ({
    shown: { source: '', aspect: 4 / 3, marks: [] },
    help: false,
    voice: false,
    voiceFails: '',
    speaks: 'speechSynthesis' in window,
    icons: ICONS,
    signs: SIGNS,
    words: WORDS,
  }),
  computed: {
    paused() {
      return this.board.phase === 'paused';
    },
    verdict() {
      if (this.board.phase !== 'answer' || this.board.right == null) return '';
      return this.board.right ? 'right' : 'wrong';
    },
    showsNumber() {
      const asks = this.board.phase === 'thing' || (this.board.phase === 'answer' && !this.verdict);
      return asks && this.board.number != null && !this.board.silent;
    },
    sign() {
      return SIGNS[this.board.silent ? '' : this.verdict || this.board.phase] ?? SIGNS.starting;
    },
    signTitle() {
      return this.showsNumber ? 'The thing to look at.' : '';
    },
    detail() {
      const { phase, number, silent } = this.board;
      if (silent) return 'Look at the terminal in which it was started.';
      if (phase !== 'answer') return DETAILS[phase] ?? '';
      return number == null ? '' : `You were asked to look at thing ${number}.`;
    },
    explains() {
      return ['idle', 'starting'].includes(this.board.phase) && !this.board.silent;
    },
    progress() {
      const { trial, trials } = this.board;
      return trials ? this.percent(Math.min(trial ?? 0, trials) / trials) : '0';
    },
    rate() {
      return this.board.learner.successes / this.board.learner.trials;
    },
    low() {
      return this.board.learner.interval[0];
    },
    high() {
      return this.board.learner.interval[1];
    },
    scaleText() {
      return `That is ${this.percent(this.rate)}; ` +
        `the 95 % interval reaches from ${this.percent(this.low)} to ${this.percent(this.high)}.`;
    },
    judgement() {
      if (this.board.chance == null) return '';
      if (this.low > this.board.chance) return 'This is better than guessing.';
      if (this.high < this.board.chance) return 'This is worse than guessing.';
      return 'This is not clearly better than guessing.';
    },
    voiceText() {
      if (!this.speaks) return 'No voice';
      return this.voice ? 'Voice on' : 'Voice off';
    },
    voiceTitle() {
      if (!this.speaks) return 'This browser has no voice.';
      return this.voiceFails || 'Speak each request. Browsers want one press for this.';
    },
    request() {
      const { phase, message, number, trial } = this.board;
      return [phase, message, number, trial].join('\n');
    },
  },
  watch: {
    'board.picture': { handler: 'loadPicture', immediate: true },
    'board.marks'() {
      if (this.board.picture === this.shown.source) this.shown.marks = this.board.marks;
    },
    request() {
      this.speak();
    },
  },
  mounted() {
    window.addEventListener('keydown', this.onKey);
    this.loadPicture();
  },
  unmounted() {
    window.removeEventListener('keydown', this.onKey);
    if (this.speaks) speechSynthesis.cancel();
  },
  methods: {
    // Numbers and picture change at once: the numbers stand at places in this very picture.
    loadPicture() {
      const { picture: source, aspect, marks } = this.board;
      if (!source || this.loading || !this.$refs.view) return;
      this.loading = true;
      const image = new Image();
      const next = () => {
        this.loading = false;
        if (this.board.picture !== source) this.loadPicture();
      };
      image.onload = () => {
        this.$refs.view?.replaceChildren(image);
        this.shown = { source, aspect, marks };
        next();
      };
      image.onerror = () => setTimeout(next, 500);
      image.alt = 'what the head sees';
      image.src = source;
    },
    markClasses(mark) {
      const { phase, number, answer } = this.board;
      const asked = !this.board.silent && mark.number === number && (phase === 'thing' || phase === 'answer');
      const answered = mark.number === answer && phase === 'answer';
      return {
        'mb-outside': mark.outside,
        'mb-below': mark.y < 0.2,
        'mb-asked': asked,
        'mb-hit': answered && this.verdict === 'right',
        'mb-miss': answered && this.verdict === 'wrong',
      };
    },
    percent: (share) => `${Math.round(share * 100)}%`,
    can(control) {
      return this.board.controls.includes(control);
    },
    togglePause() {
      if (this.can('pause')) this.$emit('pause', !this.paused);
    },
    moved() {
      if (this.board.phase === 'rearrange' && this.can('moved')) this.$emit('moved');
    },
    askToEnd() {
      if (this.can('end') && this.board.phase !== 'ended') this.$refs.confirm.showModal();
    },
    end() {
      this.$refs.confirm.close();
      this.$emit('end');
    },
    toggleHelp() {
      this.help = !this.help;
    },
    toggleVoice() {
      if (!this.speaks) return;
      this.voice = !this.voice;
      this.voiceFails = '';
      if (this.voice) this.speak();
      else speechSynthesis.cancel();
    },
    speak() {
      if (!this.voice || !this.board.message) return;
      speechSynthesis.cancel();
      const utterance = new SpeechSynthesisUtterance(this.board.message);
      utterance.lang = 'en';
      utterance.onerror = (event) => {
        if (event.error === 'interrupted' || event.error === 'canceled') return;
        this.voice = false;
        this.voiceFails = `The browser could not speak: ${event.error}.`;
      };
      speechSynthesis.speak(utterance);
    },
    // A button that was clicked gives up the keyboard: the space bar would press it again.
    release(event) {
      if (event.detail > 0) event.target.closest('button')?.blur();
    },
    onKey(event) {
      if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
      if (this.$refs.confirm.open) return; // the browser closes it with Escape
      const focused = event.target.closest?.('button:focus-visible, a:focus-visible');
      if (focused && (event.key === ' ' || event.key === 'Enter')) return;
      const action = {
        ' ': this.togglePause,
        Escape: this.help ? this.toggleHelp : this.askToEnd,
        Enter: this.moved,
        v: this.toggleVoice,
        h: this.toggleHelp,
      }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action) return;
      event.preventDefault();
      action();
    },
  },
};

/** Progress bar. */

export function Progress({
  done,
  planned,
  label,
  tone = 'accent',
}: {
  done: number
  planned: number
  label: string
  tone?: 'accent' | 'good' | 'bad'
}) {
  const share = planned > 0 ? Math.min(1, done / planned) : 0
  return (
    <span
      class="progress"
      data-tone={tone}
      role="progressbar"
      aria-label={label}
      aria-valuemin={0}
      aria-valuemax={planned}
      aria-valuenow={done}
    >
      <span style={{ width: `${share * 100}%` }} />
    </span>
  )
}

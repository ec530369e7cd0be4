function paper_algorithm(input_file)
  % The algorithm of the paper (Section 3.4), vectorised over the springs; see rival.py.
  % Prints the seconds of the loop, then the integral of x after every stretch.
  load(input_file);  % shear, limit (rows), mass, cell_stiffness, path
  integrals = zeros(rows(path), 1);
  q = zeros(size(limit));
  x = 0; v = 0; force = 0; u = 0; integral = 0;
  tic;
  for s = 1:rows(path)
    start = path(s, 1); stop = path(s, 2); steps = path(s, 3); dt = path(s, 4);
    for i = 1:steps
      v = v + 0.5 * dt * (-cell_stiffness * x - force) / mass;
      integral = integral + 0.5 * dt * x;
      x = x + dt * v;
      integral = integral + 0.5 * dt * x;
      du = x - (start + (stop - start) * (i / steps)) - u;
      u = u + du;
      q = min(max(q + shear * du, -limit), limit);
      force = sum(q);
      v = v + 0.5 * dt * (-cell_stiffness * x - force) / mass;
    end
    integrals(s) = integral;
  end
  seconds = toc;
  printf('%.17g\n', seconds, integrals);
end
